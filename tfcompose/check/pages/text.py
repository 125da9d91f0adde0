"""What is found in a file as text: YAML, keys, values, units, files that it names."""

from __future__ import annotations

PAGES = {
    "TF001": """A file cannot be read, or is no text.

A robot file is UTF-8 text. Check the name, and that it is a file that you may read.""",
    "TF002": """The file is not YAML, not one document, or not a mapping.

The place is where reading stopped; the fault is there or just above. A robot file is one mapping and begins with
tfcompose: 1.""",
    "TF003": """A key is given twice in one mapping.

YAML readers take one of the two without a word. Keep the one that is meant.""",
    "TF004": """A key is a number, true, false, null, a list or a mapping.

Names are texts. Put the key in quotes.""",
    "TF005": """A value carries a tag that the language does not have.

Tags such as !degrees are not used: a text may carry a unit instead, 15 deg.""",
    "TF006": """A key has no value.

map: says nothing; map: {} says that there is such a frame. In an overlay, null removes a key.""",
    "TF007": """A number is not finite.

Infinity and NaN have no place in a robot; tf2 drops transforms that hold one.""",
    "TF008": """The file is larger, deeper, or by its aliases longer than a robot can be.

The limits keep a mistake, or a file that is meant to do harm, from taking all memory.""",
    "TF009": """There is no such profile.

Profiles are the entries of the section profiles.""",
    "TF010": """An overlay removes a key that is not there.

Probably the key has another name, or the overlay is out of date.""",
    "TF011": """<< does not name a mapping.

<< takes an alias of a mapping, or a list of such aliases.""",
    "TF012": """A comment allows a finding that is not there.

The fault has been mended, or the code is another. Remove the comment, so that it does not hide the next fault.""",
    "TF013": """A comment allows a finding and does not say why.

Write the reason behind it: allow TF401 because the lens is turned.""",
    "TF014": """An overlay sets a value that is there already.

It hides that the value is no longer meant to differ, or that the overlay was meant for another key.""",
    "TF015": """Files include each other, or are too many.

A file cannot be laid over itself.""",
    "TF016": """A setting on the command line is not PATH=VALUE.

PATH has dots between its keys: sensors.camera.tf=driver.""",
    "TF017": """An entry under rules is no code, or one that cannot be set.

Findings about text and keys (TF0 and TF1) always count, and those without whose end there is no robot to build: two
parents, cycles, frames and owners that are not there, processes that wait for each other.""",
    "TF018": """A file is not XML, not a robot, or declares entities.

The place is where reading stopped. A URDF is one <robot>; with xacro the message is xacro's own.""",
    "TF019": """A file or folder that ${file(…)} or cwd names is not there.

A path is relative to the file that writes it, not to the folder that tfcompose is started in.""",
    "TF101": """A key is not known here.

Probably it is misspelt; unknown keys are refused, because a key that is silently dropped is a frame in the wrong
place.""",
    "TF102": """A key is missing.

Without it the entry has no meaning.""",
    "TF103": """A value is of another kind than expected: a text for a number, a list of another length.""",
    "TF104": """A unit is not known, or is of another kind of quantity.

Bare numbers are SI: m, rad, kg, s, Hz. A text may carry a unit: 30 cm, 15 deg, 50 Hz, 200 ms.""",
    "TF105": """An expression ${…} cannot be computed.

It may hold vars, quantities, pi, + - * / ( ), and sin cos tan sqrt radians degrees.""",
    "TF106": """A value is not one of those that are allowed here.""",
    "TF107": """Two keys exclude each other.

A rotation is written in one way, a process runs in one way, a shape has one form.""",
}
