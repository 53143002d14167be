"""Messages to values: ROS, Protobuf, JSON, and the tables that they fill."""
