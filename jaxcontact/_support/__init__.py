"""Shared foundations without physics: pytrees, checks, status codes, scales, progress and whole files."""
