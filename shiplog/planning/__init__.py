"""What to sail next: the manoeuvre from which a run's coefficients would be known best.

noise         process noise of the run, and noise of the ship's sensors
information   how sure the coefficients will be after a manoeuvre
limits        water, rudder, speed and time
search        the manoeuvre that says most within them
causes        which causes it would tell apart, and which sensor would
"""
