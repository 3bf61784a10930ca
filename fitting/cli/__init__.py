"""The commands jaxcontact fit."""
