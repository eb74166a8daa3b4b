"""Layer ``ros``: rclpy nodes and what they are made of; no mathematics."""

from sysid_node.ros.environment import find_packages

find_packages()
