"""What every wing builds on.

Findings and their codes, geometry, units, numbers, text, trees and signals.

Must not import ``model``, ``spec``, ``compiler``, ``tf``, ``guard``, ``launcher``, ``cli``,
``tools``.
"""
