"""The page of ``jaxcontact play`` and its server, which need nothing but the standard library.

They are a package of their own, since importing anything from ``jaxcontact`` first imports jax, which takes a second: the
page is there before.
"""
