"""A sensor's preset of one's own, and what can be wrong in one."""

MAST = """
preset: 1
vendor: me
model: mast camera
kind: camera
about: a camera that we built
mount: "{name}_foot"
frames:
  "{name}_optical_frame": {parent: "{name}_foot", xyz: [0, 0, 30 cm], rpy: [-90 deg, 0, -90 deg]}
"""
#: What stands in it, and what is written instead that is wrong.
WRONG_IN_MAST = (
    ('parent: "{name}_foot"', 'parent: "{name}_fot"'),
    ("kind: camera", "kind: camra"),
    ("rpy: [-90 deg", "when: {colour: true}, rpy: [-90 deg"),
    ('mount: "{name}_foot"', 'mount: "{name}_{place}"'),
    ("model: mast camera", "model: mast camera\nextends: me/mist"),
    ("model: mast camera", "model: mast camera\nextends: me/mast"),
    ("about: a", "abut: a"),
    ("frames:\n", "options: {o: {type: choice, variants: {a: 5}, default: a}}\nframes:\n"),
    ("frames:\n", "options: {o: {type: choice, variants: {a: {}}, default: [a]}}\nframes:\n"),
    ("frames:\n", "options: {o: {type: set, values: [a], default: b}}\nframes:\n"),
    ("frames:\n", 'body: {frame: "{name}_foot", shape: {xyz: [0, 0, 1]}}\nframes:\n'),
    ("rpy: [-90 deg", "look: up, rpy: [-90 deg"),
    ("frames:\n", "driver: {package: p, node: n}\nframes:\n"),
    ("frames:\n", 'body: {frame: "{name}_case", shape: {box: [1, 1, 1]}}\nframes:\n'),
)
