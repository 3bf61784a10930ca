"""The page of ``jaxcontact play``: its server, its presets, and the contacts that follow its sliders."""
