"""The commands ``jaxcontact fit``."""
