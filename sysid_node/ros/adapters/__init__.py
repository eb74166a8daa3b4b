"""What other autopilots publish, as the identifier's topics. All but the node ``adapter`` itself runs without ROS."""
