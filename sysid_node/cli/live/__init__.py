"""What the commands that run ROS nodes share: processes, a ROS domain of their own, and the live table."""
