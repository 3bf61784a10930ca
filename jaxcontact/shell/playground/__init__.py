"""The command ``jaxcontact play``: its contacts, and the server of its page."""
