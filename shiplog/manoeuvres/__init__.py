"""Manoeuvres: found in logs, measured, simulated, and compared with the standards for them.

recognition    which stretches of a voyage are turns, zigzags, stops, pull-outs and spirals
drift          the current, from positions 360 degrees apart in a turn
turning, zigzags, stopping, steadiness     the quantities of each kind
conditions     in which it was sailed, and why it is or is not of the standard
criteria       IMO's limits, and to which ships they apply
scaling        from a model to a ship, and from ballast to full load
"""
