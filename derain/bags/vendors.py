"""Topics of LiDARs that are no point clouds yet, and what makes point clouds of them.

Most drivers publish what the sensor sends, and a second node decodes it; many bags hold the first
alone, for it is smaller.
"""

# The package of a message's type, and its name where the package has others → what decodes it.
DECODERS = {
    "velodyne_msgs/VelodyneScan": "velodyne_pointcloud's transform node",
    "ouster_sensor_msgs/PacketMsg": "ouster_ros (os_cloud, or its replay launch file)",
    "ouster_msgs/PacketMsg": "ouster_ros (os_cloud, or its replay launch file)",
    "ouster_ros/PacketMsg": "ouster_ros (os_cloud, or its replay launch file)",
    "livox_ros_driver/CustomMsg": "livox_ros_driver with xfer_format 0, or a livox converter",
    "livox_ros_driver2/CustomMsg": "livox_ros_driver2 with xfer_format 0, or a livox converter",
    "livox_interfaces/CustomMsg": "livox_ros2_driver with xfer_format 0, or a livox converter",
    "hesai_ros_driver/UdpFrame": "hesai_ros_driver, or nebula",
    "pandar_msgs/PandarScan": "hesai's pandar_pointcloud, or nebula",
    "nebula_msgs/NebulaPackets": "nebula",
    "rslidar_msg/RslidarPacket": "rslidar_sdk",
    "rslidar_msgs/rslidarScan": "rslidar_pointcloud, or rslidar_sdk",
    "sensor_msgs/PointCloud": "point_cloud_converter",
    "sensor_msgs/LaserScan": "laser_geometry, though it is one line and no cloud",
}


def decoder_of(message_type: str) -> str | None:
    """What makes PointCloud2 of a type of message; None where that is not known.

    Args:
        message_type: Its type, such as ``velodyne_msgs/msg/VelodyneScan``.
    """
    return DECODERS.get(message_type.replace("/msg/", "/"))
