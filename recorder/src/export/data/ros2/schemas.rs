//! The definitions of the messages, as ROS 2 writes them into a bag: a message, then those that it contains.

/// Name and definition of a message.
pub(super) struct MessageType {
    pub(super) name: &'static str,
    pub(super) definition: &'static str,
}

pub(super) const POINT_CLOUD: MessageType = MessageType {
    name: "sensor_msgs/msg/PointCloud2",
    definition: "\
std_msgs/Header header
uint32 height
uint32 width
sensor_msgs/PointField[] fields
bool is_bigendian
uint32 point_step
uint32 row_step
uint8[] data
bool is_dense
================================================================================
MSG: std_msgs/Header
builtin_interfaces/Time stamp
string frame_id
================================================================================
MSG: builtin_interfaces/Time
int32 sec
uint32 nanosec
================================================================================
MSG: sensor_msgs/PointField
uint8 INT8=1
uint8 UINT8=2
uint8 INT16=3
uint8 UINT16=4
uint8 INT32=5
uint8 UINT32=6
uint8 FLOAT32=7
uint8 FLOAT64=8
string name
uint32 offset
uint8 datatype
uint32 count
",
};

pub(super) const STRING: MessageType =
    MessageType { name: "std_msgs/msg/String", definition: "string data\n" };

pub(super) const TRANSFORMS: MessageType = MessageType {
    name: "tf2_msgs/msg/TFMessage",
    definition: "\
geometry_msgs/TransformStamped[] transforms
================================================================================
MSG: geometry_msgs/TransformStamped
std_msgs/Header header
string child_frame_id
geometry_msgs/Transform transform
================================================================================
MSG: std_msgs/Header
builtin_interfaces/Time stamp
string frame_id
================================================================================
MSG: builtin_interfaces/Time
int32 sec
uint32 nanosec
================================================================================
MSG: geometry_msgs/Transform
geometry_msgs/Vector3 translation
geometry_msgs/Quaternion rotation
================================================================================
MSG: geometry_msgs/Vector3
float64 x
float64 y
float64 z
================================================================================
MSG: geometry_msgs/Quaternion
float64 x
float64 y
float64 z
float64 w
",
};
