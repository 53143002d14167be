"""What is measured about shiplog itself. It is not installed with the program."""
