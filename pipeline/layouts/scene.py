"""The panel that shows the scene of an experiment in space."""

from collections.abc import Iterator

from pipeline.layouts.panels import Panel
from pipeline.layouts.topics import Topics
from pipeline.scene.schemas import FRAME, SCENE, WORLD


def scene_panel(topics: Topics, middle: tuple[float, float], size: float) -> Iterator[Panel]:
    """Yield a 3D panel with all scenes, seen from above and as wide as what is shown, if there are any."""
    scenes, frames = topics.of_schema(SCENE), topics.of_schema(FRAME)
    if scenes:
        yield Panel(
            "3D",
            "Scene",
            {
                "cameraState": {
                    "perspective": False,
                    "distance": round(1.1 * size, 6),
                    "phi": 0,
                    "thetaOffset": 0,
                    "target": [0, 0, 0],
                    "targetOffset": [round(middle[0], 6), round(middle[1], 6), 0],
                    "targetOrientation": [0, 0, 0, 1],
                    "fovy": 45,
                    "near": 0.01,
                    "far": 5000,
                },
                "followTf": WORLD,
                "followMode": "follow-none",
                "scene": {"enableStats": False, "transforms": {"showLabel": False, "axisScale": 0, "lineWidth": 0}},
                "topics": {name: {"visible": True} for name in (*scenes, *frames)},
                "layers": {},
            },
        )
