"""A ROS 2 node that says how hard one fingertip shall press; run it where `stiction-client` is installed:

    python3 examples/ros2/node.py --ros-args -p contact_area:=6e-5 -p round_at:=5.0 \
        -p least_force:=0.5 -p most_force:=30.0 -p model:=cardboard.json -r ~/wrench:=/finger/wrench

It takes geometry_msgs/WrenchStamped from `~/wrench` and std_msgs/Float64 from `~/stick_ratio` (of a Stiction detector
or stream), and publishes std_msgs/Float64 on `~/grip_force`, N. `model` is a file of `FrictionModel.save`; without it
the controller learns. Any other setting of docs/control.md is a parameter of its name.
"""

import sys
from pathlib import Path

import rclpy
from geometry_msgs.msg import WrenchStamped
from rclpy.node import Node
from std_msgs.msg import Float64

sys.path.insert(0, str(Path(__file__).parent))
from grip import Grip, seconds, settings_of

from stiction_client import FrictionModel


class GripNode(Node):
    """Wrenches and stick ratios in, grip forces out."""

    def __init__(self) -> None:
        super().__init__("stiction_grip", automatically_declare_parameters_from_overrides=True)
        given = {name: parameter.value for name, parameter in self.get_parameters_by_prefix("").items()}
        model = FrictionModel.load(given["model"]) if given.get("model") else None
        self._grip, self._mode = Grip(settings_of(given), model), ""
        self._publisher = self.create_publisher(Float64, "~/grip_force", 10)
        self.create_subscription(WrenchStamped, "~/wrench", self.on_wrench, 10)
        self.create_subscription(Float64, "~/stick_ratio", self.on_stick_ratio, 10)

    def on_stick_ratio(self, message: Float64) -> None:
        """Such a message has no stamp: it is of now."""
        now = self.get_clock().now().to_msg()
        self._grip.on_stick_ratio(seconds(now.sec, now.nanosec), message.data)

    def on_wrench(self, message: WrenchStamped) -> None:
        """Command, and log each change of the mode."""
        stamp, force, torque = message.header.stamp, message.wrench.force, message.wrench.torque
        time = seconds(stamp.sec, stamp.nanosec)
        command = self._grip.on_wrench(time, (force.x, force.y, force.z), (torque.x, torque.y, torque.z))
        if command is None:
            return
        self._publisher.publish(Float64(data=command.normal_force))
        if command.mode != self._mode:
            self._mode = command.mode
            self.get_logger().info(f"{command.mode}: {command.normal_force:.2f} N, {command.reason}")


def main() -> None:
    """Spin until ROS ends."""
    rclpy.init()
    try:
        rclpy.spin(GripNode())
    finally:
        rclpy.try_shutdown()


if __name__ == "__main__":
    main()
