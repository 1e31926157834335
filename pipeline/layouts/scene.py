"""The panel that shows the scene of an experiment in space."""

from collections.abc import Iterator

from pipeline.layouts.panels import Panel
from pipeline.layouts.topics import Topics

LOG, SCENE, FRAME = "foxglove.Log", "foxglove.SceneUpdate", "foxglove.FrameTransform"
WORLD = "world"


def scene_panel(topics: Topics) -> Iterator[Panel]:
    """Yield a 3D panel with all scenes, seen from above, if there are any."""
    scenes, frames = topics.of_schema(SCENE), topics.of_schema(FRAME)
    if scenes:
        yield Panel(
            "3D",
            "Scene",
            {
                "cameraState": {
                    "perspective": False,
                    "distance": 8,
                    "phi": 0,
                    "thetaOffset": 0,
                    "target": [0, 0, 0],
                    "targetOffset": [0, 0, 0],
                    "targetOrientation": [0, 0, 0, 1],
                    "fovy": 45,
                    "near": 0.01,
                    "far": 5000,
                },
                "followTf": WORLD,
                "followMode": "follow-none",
                "scene": {"enableStats": False, "transforms": {"showLabel": False}},
                "topics": {name: {"visible": True} for name in (*scenes, *frames)},
                "layers": {},
                "foxglovePanelTitle": "Scene",
            },
        )
