from pathlib import Path

from setuptools import find_packages, setup

NAME = "sysid_node"
SHARE = f"share/{NAME}"
DATA = ("config", "config/aircraft", "config/layouts", "launch")


def files_of(folder):
    return [str(path) for path in sorted(Path(folder).glob("*.*"))]


setup(
    name=NAME,
    version="0.1.0",
    packages=find_packages(include=[NAME, f"{NAME}.*"]),
    package_data={NAME: ["report/templates/**/*"]},
    data_files=[
        ("share/ament_index/resource_index/packages", [f"resource/{NAME}"]),
        (SHARE, ["package.xml"]),
        *((f"{SHARE}/{folder}", files_of(folder)) for folder in DATA),
    ],
    zip_safe=False,
    maintainer="sysid maintainers",
    maintainer_email="maintainers@sysid.invalid",
    description="Identifies a fixed-wing aircraft's stability and control derivatives in flight.",
    license="Apache-2.0",
    entry_points={
        "console_scripts": [
            "adapter = sysid_node.ros.adapter:main",
            "adaptive_controller = sysid_node.ros.adaptive_controller:main",
            "exciter = sysid_node.ros.exciter:main",
            "fault_monitor = sysid_node.ros.fault_monitor:main",
            "flight_simulator = sysid_node.ros.flight_simulator:main",
            "identifier = sysid_node.ros.identifier:main",
            "markers = sysid_node.cli.live.markers:main",
            "player = sysid_node.ros.player:main",
            "recorder = sysid_node.ros.recorder:main",
            "sysid = sysid_node.cli.main:main",
            "view = sysid_node.cli.live.viewing:main",
        ],
    },
)
