//! The messages of all schemas, as a table.

use prost_types::field_descriptor_proto::Type;

/// A message and the file that declares it.
pub(super) struct Declaration {
    pub(super) package: &'static str,
    pub(super) name: &'static str,
    pub(super) file: &'static str,
    pub(super) fields: &'static [Field],
}

/// Name, number, type.
pub(super) type Field = (&'static str, i32, Kind);

#[derive(Clone, Copy)]
pub(super) enum Kind {
    Plain(Type),
    /// A message, by its full name.
    Message(&'static str),
    /// A list of messages.
    List(&'static str),
    /// A list of numbers.
    Numbers(Type),
    /// An enum that is nested in this message, with its values from 0.
    Enum {
        name: &'static str,
        values: &'static [&'static str],
    },
}

const DOUBLE: Kind = Kind::Plain(Type::Double);
const FIXED32: Kind = Kind::Plain(Type::Fixed32);
const INT32: Kind = Kind::Plain(Type::Int32);
const INT64: Kind = Kind::Plain(Type::Int64);
const BOOL: Kind = Kind::Plain(Type::Bool);
const BYTES: Kind = Kind::Plain(Type::Bytes);
const STRING: Kind = Kind::Plain(Type::String);
const TIMESTAMP: Kind = Kind::Message("google.protobuf.Timestamp");
const VECTOR3: Kind = Kind::Message("foxglove.Vector3");
const QUATERNION: Kind = Kind::Message("foxglove.Quaternion");
const POSE: Kind = Kind::Message("foxglove.Pose");
const COLOR: Kind = Kind::Message("foxglove.Color");
const NUMERIC_TYPE: Kind = Kind::Enum {
    name: "NumericType",
    values: &[
        "UNKNOWN", "UINT8", "INT8", "UINT16", "INT16", "UINT32", "INT32", "FLOAT32", "FLOAT64",
    ],
};
const LINE_TYPE: Kind =
    Kind::Enum { name: "Type", values: &["LINE_STRIP", "LINE_LOOP", "LINE_LIST"] };
const DELETION_TYPE: Kind = Kind::Enum { name: "Type", values: &["MATCHING_ID", "ALL"] };

/// Dependencies come before their users, as readers of a descriptor set expect.
pub(super) const DECLARATIONS: [Declaration; 23] = [
    Declaration {
        package: "google.protobuf",
        name: "Timestamp",
        file: "google/protobuf/timestamp.proto",
        fields: &[("seconds", 1, INT64), ("nanos", 2, INT32)],
    },
    Declaration {
        package: "foxglove",
        name: "Vector3",
        file: "foxglove/Vector3.proto",
        fields: &[("x", 1, DOUBLE), ("y", 2, DOUBLE), ("z", 3, DOUBLE)],
    },
    Declaration {
        package: "foxglove",
        name: "Quaternion",
        file: "foxglove/Quaternion.proto",
        fields: &[("x", 1, DOUBLE), ("y", 2, DOUBLE), ("z", 3, DOUBLE), ("w", 4, DOUBLE)],
    },
    Declaration {
        package: "foxglove",
        name: "Pose",
        file: "foxglove/Pose.proto",
        fields: &[("position", 1, VECTOR3), ("orientation", 2, QUATERNION)],
    },
    Declaration {
        package: "foxglove",
        name: "PackedElementField",
        file: "foxglove/PackedElementField.proto",
        fields: &[("name", 1, STRING), ("offset", 2, FIXED32), ("type", 3, NUMERIC_TYPE)],
    },
    Declaration {
        package: "foxglove",
        name: "PointCloud",
        file: "foxglove/PointCloud.proto",
        fields: &[
            ("timestamp", 1, TIMESTAMP),
            ("frame_id", 2, STRING),
            ("pose", 3, POSE),
            ("point_stride", 4, FIXED32),
            ("fields", 5, Kind::List("foxglove.PackedElementField")),
            ("data", 6, BYTES),
        ],
    },
    Declaration {
        package: "foxglove",
        name: "FrameTransform",
        file: "foxglove/FrameTransform.proto",
        fields: &[
            ("timestamp", 1, TIMESTAMP),
            ("parent_frame_id", 2, STRING),
            ("child_frame_id", 3, STRING),
            ("translation", 4, VECTOR3),
            ("rotation", 5, QUATERNION),
        ],
    },
    Declaration {
        package: "catenary",
        name: "Keyframe",
        file: "catenary/Keyframe.proto",
        fields: &[("step", 1, Kind::Plain(Type::Uint64)), ("data", 2, BYTES)],
    },
    Declaration {
        package: "foxglove",
        name: "Color",
        file: "foxglove/Color.proto",
        fields: &[("r", 1, DOUBLE), ("g", 2, DOUBLE), ("b", 3, DOUBLE), ("a", 4, DOUBLE)],
    },
    Declaration {
        package: "foxglove",
        name: "ArrowPrimitive",
        file: "foxglove/ArrowPrimitive.proto",
        fields: &[
            ("pose", 1, POSE),
            ("shaft_length", 2, DOUBLE),
            ("shaft_diameter", 3, DOUBLE),
            ("head_length", 4, DOUBLE),
            ("head_diameter", 5, DOUBLE),
            ("color", 6, COLOR),
        ],
    },
    Declaration {
        package: "foxglove",
        name: "CubePrimitive",
        file: "foxglove/CubePrimitive.proto",
        fields: &[("pose", 1, POSE), ("size", 2, VECTOR3), ("color", 3, COLOR)],
    },
    Declaration {
        package: "foxglove",
        name: "CylinderPrimitive",
        file: "foxglove/CylinderPrimitive.proto",
        fields: &[
            ("pose", 1, POSE),
            ("size", 2, VECTOR3),
            ("bottom_scale", 3, DOUBLE),
            ("top_scale", 4, DOUBLE),
            ("color", 5, COLOR),
        ],
    },
    Declaration {
        package: "foxglove",
        name: "KeyValuePair",
        file: "foxglove/KeyValuePair.proto",
        fields: &[("key", 1, STRING), ("value", 2, STRING)],
    },
    Declaration {
        package: "foxglove",
        name: "Point3",
        file: "foxglove/Point3.proto",
        fields: &[("x", 1, DOUBLE), ("y", 2, DOUBLE), ("z", 3, DOUBLE)],
    },
    Declaration {
        package: "foxglove",
        name: "LinePrimitive",
        file: "foxglove/LinePrimitive.proto",
        fields: &[
            ("type", 1, LINE_TYPE),
            ("pose", 2, POSE),
            ("thickness", 3, DOUBLE),
            ("scale_invariant", 4, BOOL),
            ("points", 5, Kind::List("foxglove.Point3")),
            ("color", 6, COLOR),
            ("colors", 7, Kind::List("foxglove.Color")),
            ("indices", 8, Kind::Numbers(Type::Fixed32)),
        ],
    },
    Declaration {
        package: "foxglove",
        name: "ModelPrimitive",
        file: "foxglove/ModelPrimitive.proto",
        fields: &[
            ("pose", 1, POSE),
            ("scale", 2, VECTOR3),
            ("color", 3, COLOR),
            ("override_color", 4, BOOL),
            ("url", 5, STRING),
            ("media_type", 6, STRING),
            ("data", 7, BYTES),
        ],
    },
    Declaration {
        package: "foxglove",
        name: "SpherePrimitive",
        file: "foxglove/SpherePrimitive.proto",
        fields: &[("pose", 1, POSE), ("size", 2, VECTOR3), ("color", 3, COLOR)],
    },
    Declaration {
        package: "foxglove",
        name: "TextPrimitive",
        file: "foxglove/TextPrimitive.proto",
        fields: &[
            ("pose", 1, POSE),
            ("billboard", 2, BOOL),
            ("font_size", 3, DOUBLE),
            ("scale_invariant", 4, BOOL),
            ("color", 5, COLOR),
            ("text", 6, STRING),
        ],
    },
    Declaration {
        package: "foxglove",
        name: "TriangleListPrimitive",
        file: "foxglove/TriangleListPrimitive.proto",
        fields: &[
            ("pose", 1, POSE),
            ("points", 2, Kind::List("foxglove.Point3")),
            ("color", 3, COLOR),
            ("colors", 4, Kind::List("foxglove.Color")),
            ("indices", 5, Kind::Numbers(Type::Fixed32)),
        ],
    },
    Declaration {
        package: "google.protobuf",
        name: "Duration",
        file: "google/protobuf/duration.proto",
        fields: &[("seconds", 1, INT64), ("nanos", 2, INT32)],
    },
    Declaration {
        package: "foxglove",
        name: "SceneEntity",
        file: "foxglove/SceneEntity.proto",
        fields: &[
            ("timestamp", 1, TIMESTAMP),
            ("frame_id", 2, STRING),
            ("id", 3, STRING),
            ("lifetime", 4, Kind::Message("google.protobuf.Duration")),
            ("frame_locked", 5, BOOL),
            ("metadata", 6, Kind::List("foxglove.KeyValuePair")),
            ("arrows", 7, Kind::List("foxglove.ArrowPrimitive")),
            ("cubes", 8, Kind::List("foxglove.CubePrimitive")),
            ("spheres", 9, Kind::List("foxglove.SpherePrimitive")),
            ("cylinders", 10, Kind::List("foxglove.CylinderPrimitive")),
            ("lines", 11, Kind::List("foxglove.LinePrimitive")),
            ("triangles", 12, Kind::List("foxglove.TriangleListPrimitive")),
            ("texts", 13, Kind::List("foxglove.TextPrimitive")),
            ("models", 14, Kind::List("foxglove.ModelPrimitive")),
        ],
    },
    Declaration {
        package: "foxglove",
        name: "SceneEntityDeletion",
        file: "foxglove/SceneEntityDeletion.proto",
        fields: &[("timestamp", 1, TIMESTAMP), ("type", 2, DELETION_TYPE), ("id", 3, STRING)],
    },
    Declaration {
        package: "foxglove",
        name: "SceneUpdate",
        file: "foxglove/SceneUpdate.proto",
        fields: &[
            ("deletions", 1, Kind::List("foxglove.SceneEntityDeletion")),
            ("entities", 2, Kind::List("foxglove.SceneEntity")),
        ],
    },
];
