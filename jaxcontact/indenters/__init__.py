"""Indenters, and an estimate of the contact that they make."""
