"""References as trajectories of joints, `trajectory_msgs/msg/JointTrajectory` of ROS 2: no ROS is needed."""
