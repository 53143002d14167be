"""How often the intervals of the manoeuvre sheet, and of coefficients, hold the truth.

trials         turns and zigzags of a simulated ship, and what they truly were
coefficients   the truths' own coefficients, in the model's names
one_ship       a ship: training campaign, model, held-out trials, its sheet against the truth
in_a_current   a turn in a current that the model never met
tables         shares and widths over all ships
"""
