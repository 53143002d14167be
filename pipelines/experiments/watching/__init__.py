"""`shiplog watch` on ships of other simulators: how often it is wrong, how soon it is right.

Five ships, each with a nominal campaign and a model of its own. The same ships then sail on without
any change for hours, and on other days with something hidden that begins half-way.
"""
