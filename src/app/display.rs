//! Which display server a window is opened on.

use egui_winit::winit::event_loop::EventLoopBuilder;

/// Has the window opened with X where the environment names a Wayland server that is not there, as a shell that was left
/// by another session may.
#[cfg(target_os = "linux")]
pub(super) fn choose<T: 'static>(events: &mut EventLoopBuilder<T>) {
    use egui_winit::winit::platform::x11::EventLoopBuilderExtX11;

    let named = |name: &str| std::env::var_os(name).filter(|value| !value.is_empty());
    let Some(display) = named("WAYLAND_DISPLAY") else { return };
    if named("WAYLAND_SOCKET").is_some() || named("DISPLAY").is_none() {
        return;
    }
    let folder = named("XDG_RUNTIME_DIR").unwrap_or_default();
    // An absolute name stands for itself.
    let socket = std::path::Path::new(&folder).join(display);
    if let Err(error) = std::os::unix::net::UnixStream::connect(&socket) {
        log::info!("no Wayland server at {} ({error}): X is used", socket.display());
        events.with_x11();
    }
}

#[cfg(not(target_os = "linux"))]
pub(super) fn choose<T: 'static>(_: &mut EventLoopBuilder<T>) {}
