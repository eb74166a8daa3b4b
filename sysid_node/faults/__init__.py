"""Layer ``faults``: which surface, sensor or part of the airframe has failed, by how much and since when. No ROS."""
