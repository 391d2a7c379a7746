"""Republishes the snapshots of a running node as PointCloud2 on /particles, 30 times a second."""

import catenary
import rclpy
from rclpy.node import Node
from sensor_msgs.msg import PointCloud2, PointField

NAMES = ["x", "y", "z", "inverse_mass", "vx", "vy", "vz"]
FIELDS = [PointField(name=name, offset=4 * i, datatype=7, count=1) for i, name in enumerate(NAMES)]
FIELDS.append(PointField(name="flags", offset=28, datatype=6, count=1))

class Particles(Node):
    def __init__(self) -> None:
        super().__init__("catenary")
        self.simulation = catenary.attach(timeout=5)
        self.clouds = self.create_publisher(PointCloud2, "particles", 1)
        self.create_timer(1 / 30, self.publish)

    def publish(self) -> None:
        snapshot = self.simulation.latest()
        cloud = PointCloud2(height=1, width=len(snapshot), fields=FIELDS, point_step=32)
        cloud.header.stamp = self.get_clock().now().to_msg()
        cloud.header.frame_id, cloud.row_step, cloud.is_dense = "world", 32 * len(snapshot), True
        cloud.data = snapshot.to_bytes()
        self.clouds.publish(cloud)

rclpy.init()
rclpy.spin(Particles())
