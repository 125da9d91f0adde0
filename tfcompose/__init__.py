"""tfcompose: one YAML file says which frames a robot has and who publishes each TF edge."""

__version__ = "0.1.0"
