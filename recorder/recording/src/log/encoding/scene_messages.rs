//! The protobuf messages of `/scene`, with the fields that a drawing needs.

use prost::Message;
use prost_types::Timestamp;

use super::protobuf::{Pose, Vector3};

/// `type` of a [`LinePrimitive`]: each pair of indices is a line.
pub(crate) const LINE_LIST: i32 = 2;

#[derive(Clone, Copy, PartialEq, Message)]
pub(crate) struct Color {
    #[prost(double, tag = "1")]
    pub(crate) r: f64,
    #[prost(double, tag = "2")]
    pub(crate) g: f64,
    #[prost(double, tag = "3")]
    pub(crate) b: f64,
    #[prost(double, tag = "4")]
    pub(crate) a: f64,
}

#[derive(Clone, Copy, PartialEq, Message)]
pub(crate) struct Point3 {
    #[prost(double, tag = "1")]
    pub(crate) x: f64,
    #[prost(double, tag = "2")]
    pub(crate) y: f64,
    #[prost(double, tag = "3")]
    pub(crate) z: f64,
}

#[derive(Clone, PartialEq, Message)]
pub(crate) struct CubePrimitive {
    #[prost(message, optional, tag = "1")]
    pub(crate) pose: Option<Pose>,
    #[prost(message, optional, tag = "2")]
    pub(crate) size: Option<Vector3>,
    #[prost(message, optional, tag = "3")]
    pub(crate) color: Option<Color>,
}

#[derive(Clone, PartialEq, Message)]
pub(crate) struct SpherePrimitive {
    #[prost(message, optional, tag = "1")]
    pub(crate) pose: Option<Pose>,
    #[prost(message, optional, tag = "2")]
    pub(crate) size: Option<Vector3>,
    #[prost(message, optional, tag = "3")]
    pub(crate) color: Option<Color>,
}

#[derive(Clone, PartialEq, Message)]
pub(crate) struct CylinderPrimitive {
    #[prost(message, optional, tag = "1")]
    pub(crate) pose: Option<Pose>,
    #[prost(message, optional, tag = "2")]
    pub(crate) size: Option<Vector3>,
    #[prost(double, tag = "3")]
    pub(crate) bottom_scale: f64,
    #[prost(double, tag = "4")]
    pub(crate) top_scale: f64,
    #[prost(message, optional, tag = "5")]
    pub(crate) color: Option<Color>,
}

#[derive(Clone, PartialEq, Message)]
pub(crate) struct LinePrimitive {
    #[prost(int32, tag = "1")]
    pub(crate) r#type: i32,
    #[prost(message, optional, tag = "2")]
    pub(crate) pose: Option<Pose>,
    #[prost(double, tag = "3")]
    pub(crate) thickness: f64,
    #[prost(bool, tag = "4")]
    pub(crate) scale_invariant: bool,
    #[prost(message, repeated, tag = "5")]
    pub(crate) points: Vec<Point3>,
    #[prost(message, optional, tag = "6")]
    pub(crate) color: Option<Color>,
    #[prost(fixed32, repeated, tag = "8")]
    pub(crate) indices: Vec<u32>,
}

#[derive(Clone, PartialEq, Message)]
pub(crate) struct TriangleListPrimitive {
    #[prost(message, optional, tag = "1")]
    pub(crate) pose: Option<Pose>,
    #[prost(message, repeated, tag = "2")]
    pub(crate) points: Vec<Point3>,
    #[prost(message, optional, tag = "3")]
    pub(crate) color: Option<Color>,
    #[prost(fixed32, repeated, tag = "5")]
    pub(crate) indices: Vec<u32>,
}

#[derive(Clone, PartialEq, Message)]
pub(crate) struct SceneEntity {
    #[prost(message, optional, tag = "1")]
    pub(crate) timestamp: Option<Timestamp>,
    #[prost(string, tag = "2")]
    pub(crate) frame_id: String,
    #[prost(string, tag = "3")]
    pub(crate) id: String,
    #[prost(message, repeated, tag = "8")]
    pub(crate) cubes: Vec<CubePrimitive>,
    #[prost(message, repeated, tag = "9")]
    pub(crate) spheres: Vec<SpherePrimitive>,
    #[prost(message, repeated, tag = "10")]
    pub(crate) cylinders: Vec<CylinderPrimitive>,
    #[prost(message, repeated, tag = "11")]
    pub(crate) lines: Vec<LinePrimitive>,
    #[prost(message, repeated, tag = "12")]
    pub(crate) triangles: Vec<TriangleListPrimitive>,
}

#[derive(Clone, PartialEq, Message)]
pub(crate) struct SceneUpdate {
    #[prost(message, repeated, tag = "2")]
    pub(crate) entities: Vec<SceneEntity>,
}
