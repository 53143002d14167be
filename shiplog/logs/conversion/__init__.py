"""What people have (tables, NMEA 0183 text, ROS bags) to logs of the contract."""
