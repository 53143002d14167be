"""Parts of `shiplog diagnose`: the trial, what is held out, where it is wrong, answer, pictures."""
