"""Record a pull with a Franka, an F/T sensor and a RealSense: ros2 launch record.launch.py bag:=my

Topics are those of franka_ros2 (Humble) and realsense2_camera with default names; the sensor's
is yours: ft:=/ft_sensor/wrench. `sling check my` says what of it can be used. Never run on a robot.
"""

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, ExecuteProcess
from launch.substitutions import LaunchConfiguration

TOPICS = {  # beside the force sensor's, geometry_msgs/msg/WrenchStamped
    "/franka_robot_state_broadcaster/current_pose": "geometry_msgs/msg/PoseStamped",
    "/franka_gripper/joint_states": "sensor_msgs/msg/JointState",
    "/camera/color/image_raw/compressed": "sensor_msgs/msg/CompressedImage",
    "/camera/depth/image_raw/compressedDepth": "sensor_msgs/msg/CompressedImage",
    "/camera/color/camera_info": "sensor_msgs/msg/CameraInfo",
    "/camera/depth/camera_info": "sensor_msgs/msg/CameraInfo",
    "/tf_static": "tf2_msgs/msg/TFMessage",
}


def generate_launch_description() -> LaunchDescription:
    bag, force = LaunchConfiguration("bag"), LaunchConfiguration("ft")
    record = ["ros2", "bag", "record", "-s", "mcap", "-o", bag, force, *TOPICS]
    return LaunchDescription(
        [
            DeclareLaunchArgument("bag", default_value="my"),
            DeclareLaunchArgument("ft", default_value="/ft_sensor/wrench"),
            ExecuteProcess(cmd=record, output="screen"),
        ]
    )
