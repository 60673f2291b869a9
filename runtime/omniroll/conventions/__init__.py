"""What other programs call wheels, speeds, poses and commands: ROS 2, WPILib, and logs of commands."""
