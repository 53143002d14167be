"""What physics and diagnosis cost, beside another build of shiplog and beside CasADi."""
