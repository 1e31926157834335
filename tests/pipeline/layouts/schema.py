"""What a layout must be for Lichtblick to import it, as JSON Schema.

Read from Lichtblick 1.28.1 (github.com/lichtblick-suite/lichtblick, packages/suite-base/src): `validateLayoutData` in
util/layout.ts, `LayoutData` in context/CurrentLayoutContext/actions.ts, `PlotConfig` in panels/Plot/utils/config.ts,
`Config` in panels/Log/types.ts, `TabPanelConfig` in types/layouts.ts, `RendererConfig` in panels/ThreeDeeRender, and
the names of panels in panels/index.ts. Settings that are not named here would be ignored there, or mean something else.
"""

from typing import Any

_TITLES = {"foxglovePanelTitle": {"type": "string"}, "lichtblickPanelTitle": {"type": "string"}}
_FLAG, _TEXT, _NUMBER = {"type": "boolean"}, {"type": "string"}, {"type": "number"}
_POINT = {"type": "array", "items": _NUMBER, "minItems": 3, "maxItems": 3}


def _exactly(fields: dict[str, Any], *optional: str) -> dict[str, Any]:
    """Return the schema of an object with these fields and no others."""
    required = [name for name in fields if name not in optional]
    return {"type": "object", "properties": fields, "required": required, "additionalProperties": False}


_ARRANGED = {"$ref": "#/$defs/arranged"}
_SPLIT = _exactly(
    {
        "direction": {"enum": ["row", "column"]},
        "first": _ARRANGED,
        "second": _ARRANGED,
        "splitPercentage": {"type": "number", "exclusiveMinimum": 0, "exclusiveMaximum": 100},
    }
)
_NAME = {"type": "string", "pattern": r"^(Plot|3D|RosOut|Tab)!\w+$"}

_PATH = _exactly(
    {
        "value": {"type": "string", "minLength": 1},
        "label": _TEXT,
        "color": {"type": "string", "pattern": "^#[0-9a-f]{6}$"},
        "enabled": _FLAG,
        "timestampMethod": {"enum": ["receiveTime", "headerStamp"]},
        "showLine": _FLAG,
    }
)
_PLOT = _exactly(
    {
        "paths": {"type": "array", "items": _PATH, "minItems": 1},
        "xAxisVal": {"enum": ["timestamp", "index", "custom", "currentCustom"]},
        "xAxisPath": _exactly({"value": _TEXT, "enabled": _FLAG}),
        "showLegend": _FLAG,
        "legendDisplay": {"enum": ["floating", "top", "left", "none"]},
        "showPlotValuesInLegend": _FLAG,
        "showXAxisLabels": _FLAG,
        "showYAxisLabels": _FLAG,
        "isSynced": _FLAG,
        "sidebarDimension": _NUMBER,
        **_TITLES,
    },
    "xAxisPath",
)
_LOG = _exactly(
    {
        "topicToRender": _TEXT,
        "searchTerms": {"type": "array", "items": _TEXT},
        "minLogLevel": {"type": "integer", "minimum": 0, "maximum": 5},
        **_TITLES,
    }
)
_TAB = _exactly(
    {
        "activeTabIdx": {"type": "integer", "minimum": 0},
        "tabs": {"type": "array", "items": _exactly({"title": _TEXT, "layout": _ARRANGED}), "minItems": 1},
    }
)
_SPACE = _exactly(
    {
        "cameraState": _exactly(
            {
                "perspective": _FLAG,
                **dict.fromkeys(("distance", "phi", "thetaOffset", "fovy", "near", "far"), _NUMBER),
                "target": _POINT,
                "targetOffset": _POINT,
                "targetOrientation": {"type": "array", "items": _NUMBER, "minItems": 4, "maxItems": 4},
            }
        ),
        "followTf": _TEXT,
        "followMode": {"enum": ["follow-pose", "follow-position", "follow-none"]},
        "scene": _exactly(
            {
                "enableStats": _FLAG,
                "transforms": _exactly({"showLabel": _FLAG, "axisScale": _NUMBER, "lineWidth": _NUMBER}),
            }
        ),
        "topics": {"type": "object", "additionalProperties": _exactly({"visible": _FLAG})},
        "layers": {"type": "object", "maxProperties": 0},
        **_TITLES,
    }
)

LAYOUT: dict[str, Any] = {
    "$defs": {"arranged": {"anyOf": [_NAME, _SPLIT]}},
    **_exactly(
        {
            "configById": {
                "type": "object",
                "patternProperties": {"^Plot!": _PLOT, "^3D!": _SPACE, "^RosOut!": _LOG, "^Tab!": _TAB},
                "propertyNames": _NAME,
            },
            "globalVariables": {"type": "object"},
            "userNodes": {"type": "object"},
            "playbackConfig": _exactly({"speed": _NUMBER}),
            "layout": _ARRANGED,
        }
    ),
}
