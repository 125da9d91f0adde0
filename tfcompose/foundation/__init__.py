"""Foundation of every wing: findings, codes, geometry, units, numbers, text, trees and signals.

Must not import ``model``, ``spec``, ``compiler``, ``tf``, ``guard``, ``launcher``, ``cli``,
``tools``.
"""
