"""What a program writes for the site: pictures, the table of rules, the tour with its outputs."""
