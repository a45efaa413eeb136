"""A ROS 2 node that says how hard one fingertip shall press; run it where `stiction-client` is installed:

    python3 examples/ros2/node.py --ros-args -p contact_area:=6e-5 -p round_at:=5.0 \
        -p least_force:=0.5 -p most_force:=30.0 -p model:=cardboard.json -r ~/wrench:=/finger/wrench

It takes geometry_msgs/WrenchStamped from `~/wrench` and std_msgs/Float64 from `~/stick_ratio` (of a Stiction detector
or stream) and, for what slips, std_msgs/Float64MultiArray from `~/slip_samples` (the share of it that moves, then
friction coefficient and normal force of each element that does), and publishes std_msgs/Float64 on `~/grip_force`, N.
`model` is a file of `FrictionModel.save`, `materials` a list of such files: without a model the controller recognises
one of these by samples of slip, or else learns. Any other setting of docs/control.md is a parameter of its name.
"""

import sys
from pathlib import Path

import rclpy
from geometry_msgs.msg import WrenchStamped
from rclpy.node import Node
from std_msgs.msg import Float64, Float64MultiArray

sys.path.insert(0, str(Path(__file__).parent))
from grip import Grip, seconds, settings_of

from stiction_client import FrictionModel


class GripNode(Node):
    """Wrenches and stick ratios in, grip forces out."""

    def __init__(self) -> None:
        super().__init__("stiction_grip", automatically_declare_parameters_from_overrides=True)
        given = {name: parameter.value for name, parameter in self.get_parameters_by_prefix("").items()}
        model = FrictionModel.load(given["model"]) if given.get("model") else None
        others = [FrictionModel.load(file) for file in given.get("materials") or ()]
        self._grip, self._mode = Grip(settings_of(given), model, {each.material: each for each in others}), ""
        self._publisher = self.create_publisher(Float64, "~/grip_force", 10)
        self.create_subscription(WrenchStamped, "~/wrench", self.on_wrench, 10)
        self.create_subscription(Float64, "~/stick_ratio", self.on_stick_ratio, 10)
        self.create_subscription(Float64MultiArray, "~/slip_samples", self.on_slip_samples, 10)

    def on_stick_ratio(self, message: Float64) -> None:
        """Such a message has no stamp: it is of now."""
        self._grip.on_stick_ratio(self._now(), message.data)

    def on_slip_samples(self, message: Float64MultiArray) -> None:
        """Neither has this one."""
        self._grip.on_slip_samples(self._now(), message.data)

    def _now(self) -> float:
        now = self.get_clock().now().to_msg()
        return seconds(now.sec, now.nanosec)

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
            of = f" of {command.material}" if command.material else ""
            self.get_logger().info(f"{command.mode}{of}: {command.normal_force:.2f} N, {command.reason}")


def main() -> None:
    """Spin until ROS ends."""
    rclpy.init()
    try:
        rclpy.spin(GripNode())
    finally:
        rclpy.try_shutdown()


if __name__ == "__main__":
    main()
