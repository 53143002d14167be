"""What a ship is and where its log has what: the profile, its file, its units."""
