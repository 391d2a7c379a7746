//! Everything that is read besides snapshots: lists of a load, and the status.

use std::ffi::{CString, c_char};
use std::mem::MaybeUninit;

use sim_contract::{
    BendState, ColliderState, CollidersHeader, ConstraintState, LoadHeader, NodeStatus,
    ParameterState, ParametersHeader, TearsHeader, TornConstraint, Triangle,
};

use crate::attached::{ClientHandle, with_client};
use crate::outcome::{CatenaryResult, Failure};
use crate::pointers::{check_place, timeout, write};

/// The constraints of a load, borrowed from the client.
#[derive(Debug)]
#[repr(C)]
pub struct Topology {
    /// Header of the load. Snapshots with the same `run_id` and `topology_revision` belong to it.
    pub header: LoadHeader,
    /// The constraints, by index.
    pub constraints: *const ConstraintState,
    /// Number of constraints.
    pub constraint_count: usize,
}

/// The bends of a load, borrowed from the client. A scene without bends has none.
#[derive(Debug)]
#[repr(C)]
pub struct Bends {
    /// Header of the load.
    pub header: LoadHeader,
    /// The bends, by index.
    pub bends: *const BendState,
    /// Number of bends.
    pub bend_count: usize,
}

/// The triangles of a load, borrowed from the client. A scene without a surface has none.
#[derive(Debug)]
#[repr(C)]
pub struct Surface {
    /// Header of the load.
    pub header: LoadHeader,
    /// The triangles.
    pub triangles: *const Triangle,
    /// Number of triangles.
    pub triangle_count: usize,
}

/// All torn constraints, borrowed from the client.
#[derive(Debug)]
#[repr(C)]
pub struct Torn {
    /// Header of the list.
    pub header: TearsHeader,
    /// The torn constraints, in the order of tearing.
    pub constraints: *const TornConstraint,
    /// Number of torn constraints.
    pub constraint_count: usize,
}

/// The values of all parameters, borrowed from the client.
#[derive(Debug)]
#[repr(C)]
pub struct Parameters {
    /// Header of the values.
    pub header: ParametersHeader,
    /// The values. `catenary_parameter_name` returns the name of each.
    pub values: *const ParameterState,
    /// Number of values.
    pub value_count: usize,
}

/// The colliders in their newest poses, borrowed from the client.
#[derive(Debug)]
#[repr(C)]
pub struct Colliders {
    /// Header of the list.
    pub header: CollidersHeader,
    /// The colliders, by index.
    pub colliders: *const ColliderState,
    /// Number of colliders.
    pub collider_count: usize,
}

/// Reads the newest topology, and waits only if none was published yet. The list is valid until the next
/// call of this function with this client.
#[unsafe(no_mangle)]
pub extern "C" fn catenary_read_topology(
    client: *mut ClientHandle,
    timeout_s: f64,
    topology: Option<&mut MaybeUninit<Topology>>,
) -> CatenaryResult {
    with_client(client, |attached| {
        check_place(topology.as_deref(), "topology")?;
        let timeout = timeout(timeout_s)?;
        let read = attached.client.topology(timeout)?;
        let read = read.ok_or_else(|| attached.nothing(timeout))?;
        attached.lists.topology = read.constraints;
        let list = &attached.lists.topology;
        let (constraints, constraint_count) = (list.as_ptr(), list.len());
        write(topology, Topology { header: read.header, constraints, constraint_count }, "topology")
    })
}

/// Reads the newest bends, like `catenary_read_topology`.
#[unsafe(no_mangle)]
pub extern "C" fn catenary_read_bends(
    client: *mut ClientHandle,
    timeout_s: f64,
    bends: Option<&mut MaybeUninit<Bends>>,
) -> CatenaryResult {
    with_client(client, |attached| {
        check_place(bends.as_deref(), "bends")?;
        let timeout = timeout(timeout_s)?;
        let read = attached.client.bends(timeout)?;
        let read = read.ok_or_else(|| attached.nothing(timeout))?;
        attached.lists.bends = read.bends;
        let list = &attached.lists.bends;
        let (pointer, bend_count) = (list.as_ptr(), list.len());
        write(bends, Bends { header: read.header, bends: pointer, bend_count }, "bends")
    })
}

/// Reads the newest surface, like `catenary_read_topology`.
#[unsafe(no_mangle)]
pub extern "C" fn catenary_read_surface(
    client: *mut ClientHandle,
    timeout_s: f64,
    surface: Option<&mut MaybeUninit<Surface>>,
) -> CatenaryResult {
    with_client(client, |attached| {
        check_place(surface.as_deref(), "surface")?;
        let timeout = timeout(timeout_s)?;
        let read = attached.client.surface(timeout)?;
        let read = read.ok_or_else(|| attached.nothing(timeout))?;
        attached.lists.surface = read.triangles;
        let list = &attached.lists.surface;
        let (triangles, triangle_count) = (list.as_ptr(), list.len());
        write(surface, Surface { header: read.header, triangles, triangle_count }, "surface")
    })
}

/// Reads the list of torn constraints, like `catenary_read_topology`.
#[unsafe(no_mangle)]
pub extern "C" fn catenary_read_torn(
    client: *mut ClientHandle,
    timeout_s: f64,
    torn: Option<&mut MaybeUninit<Torn>>,
) -> CatenaryResult {
    with_client(client, |attached| {
        check_place(torn.as_deref(), "torn")?;
        let timeout = timeout(timeout_s)?;
        let read = attached.client.torn(timeout)?;
        if read.header.run_id == 0 {
            return Err(attached.nothing(timeout));
        }
        attached.lists.torn = read.constraints;
        let list = &attached.lists.torn;
        let (constraints, constraint_count) = (list.as_ptr(), list.len());
        write(torn, Torn { header: read.header, constraints, constraint_count }, "torn")
    })
}

/// Reads the values of all parameters, like `catenary_read_topology`.
#[unsafe(no_mangle)]
pub extern "C" fn catenary_read_parameters(
    client: *mut ClientHandle,
    timeout_s: f64,
    parameters: Option<&mut MaybeUninit<Parameters>>,
) -> CatenaryResult {
    with_client(client, |attached| {
        check_place(parameters.as_deref(), "parameters")?;
        let timeout = timeout(timeout_s)?;
        let read = attached.client.parameters(timeout)?;
        let read = read.ok_or_else(|| attached.nothing(timeout))?;
        attached.lists.parameters =
            read.values.settings().into_iter().map(ParameterState::from).collect();
        let list = &attached.lists.parameters;
        let (values, value_count) = (list.as_ptr(), list.len());
        write(parameters, Parameters { header: read.header, values, value_count }, "parameters")
    })
}

/// Reads the colliders in their newest poses, like `catenary_read_topology`.
#[unsafe(no_mangle)]
pub extern "C" fn catenary_read_colliders(
    client: *mut ClientHandle,
    timeout_s: f64,
    colliders: Option<&mut MaybeUninit<Colliders>>,
) -> CatenaryResult {
    with_client(client, |attached| {
        check_place(colliders.as_deref(), "colliders")?;
        let timeout = timeout(timeout_s)?;
        let read = attached.client.colliders(timeout)?;
        if read.header.run_id == 0 {
            return Err(attached.nothing(timeout));
        }
        attached.lists.colliders = read.colliders;
        let list = &attached.lists.colliders;
        let (pointer, collider_count) = (list.as_ptr(), list.len());
        let read = Colliders { header: read.header, colliders: pointer, collider_count };
        write(colliders, read, "colliders")
    })
}

/// Reads the newest scene as TOML in UTF-8, like `catenary_read_topology`.
#[unsafe(no_mangle)]
pub extern "C" fn catenary_read_scene(
    client: *mut ClientHandle,
    timeout_s: f64,
    scene: Option<&mut MaybeUninit<*const c_char>>,
) -> CatenaryResult {
    with_client(client, |attached| {
        check_place(scene.as_deref(), "scene")?;
        let timeout = timeout(timeout_s)?;
        let read = attached.client.scene(timeout)?;
        let text = CString::new(read.ok_or_else(|| attached.nothing(timeout))?)
            .map_err(|_| Failure::new(CatenaryResult::Failed, "the scene has a zero byte"))?;
        attached.lists.scene = text;
        write(scene, attached.lists.scene.as_ptr(), "scene")
    })
}

/// Copies the newest unread status, or waits for the next one. A node publishes ten per second.
#[unsafe(no_mangle)]
pub extern "C" fn catenary_read_status(
    client: *mut ClientHandle,
    timeout_s: f64,
    status: Option<&mut MaybeUninit<NodeStatus>>,
) -> CatenaryResult {
    with_client(client, |attached| {
        check_place(status.as_deref(), "status")?;
        let timeout = timeout(timeout_s)?;
        let read = attached.client.status(timeout)?;
        write(status, read.ok_or_else(|| attached.nothing(timeout))?, "status")
    })
}
