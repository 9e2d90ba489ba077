//! Renders: one request each, blocking or on a thread of its own.
//!
//! A failure lives in its render. After a wait has said that a render is over, its thread is joined and
//! nothing of the host's is touched any more.

use super::device::{Device, Messages};
use super::error::*;
use super::guard;
use super::handle::{Handle, Kind};
use super::pixels::Statistics;
use super::pointer::{In, Out, OutStruct, Sized32};
use super::request::{RenderDesc, Request, request};
use crate::render::preview::Preview;
use crate::render::{self, Cancel, Image, Output, Plane, Settings};
use std::ffi::c_void;
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;
use std::time::Duration;

/// Not over yet.
pub const STATE_RUNNING: u32 = 1;
/// Over, with the whole image.
pub const STATE_DONE: u32 = 2;
/// Over, with the passes that were whole.
pub const STATE_CANCELLED: u32 = 3;
/// Over, without an image.
pub const STATE_FAILED: u32 = 4;

/// Called with how far a render is; 0 asks it to stop. C's `bool`, taken as a byte because a host
/// written in another language may return any.
pub type ProgressCallback = unsafe extern "C" fn(user: *mut c_void, progress: *const Progress) -> u8;
/// `caustica_done_callback`.
pub type DoneCallback = unsafe extern "C" fn(user: *mut c_void, render: Handle<Render>, result: i32);

/// `caustica_progress`.
#[derive(Clone, Copy)]
#[repr(C)]
pub struct Progress {
    /// Size of the host's struct.
    pub struct_size: u32,
    /// A `STATE_`.
    pub state: u32,
    /// 0 to 1.
    pub fraction: f32,
    /// Whole passes.
    pub samples: u32,
    /// So far.
    pub rays: u64,
    /// Since the start.
    pub elapsed_seconds: f64,
    /// Relative standard error; NaN before it is known.
    pub noise: f32,
    /// Zero.
    pub reserved: u32,
    /// Whose it is.
    pub render: Handle<Render>,
}

// SAFETY: `repr(C)`, `u32` first, numbers only.
unsafe impl Sized32 for Progress {
    const NAME: &'static str = "caustica_progress";
    const FIRST_SIZE: usize = 48;
}

/// What came of a render, and what it was.
pub(super) struct Finished {
    /// A cancelled one has an output too.
    pub(super) result: Result<Output, Failure>,
    /// As they were used.
    pub(super) settings: Settings,
    /// Of the snapshot.
    pub(super) scene_hash: u64,
    /// Its name.
    pub(super) camera: String,
}

impl Finished {
    /// What it rendered, if that is at least one pass.
    pub(super) fn output(&self) -> Result<&Output, Failure> {
        let output = self.result.as_ref().map_err(Failure::clone)?;
        match output.statistics.samples {
            0 => Err(Failure::new(ERROR_WRONG_STATE, "the render was cancelled before its first whole pass")),
            _ => Ok(output),
        }
    }
}

/// A render, running or over.
pub struct Render {
    id: u64,
    /// Whether it keeps what its samples see.
    pub(super) features: bool,
    cancel: Cancel,
    preview: Preview,
    latest: Mutex<render::Progress>,
    finished: Mutex<Option<Arc<Finished>>>,
    over: Condvar,
    thread: Mutex<Option<JoinHandle<()>>>,
}

impl Kind for Render {
    const KIND: u32 = OBJECT_RENDER;
    const NAME: &'static str = "render";
    const PLURAL: &'static str = "renders";
}

/// Locks of this module guard single assignments, which a panic cannot leave half done.
fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Render {
    fn new(id: u64, features: bool) -> Render {
        let start = render::Progress { fraction: 0.0, samples: 0, rays: 0, elapsed: Duration::ZERO, noise: f32::NAN };
        Render {
            id,
            features,
            cancel: Cancel::default(),
            preview: Preview::default(),
            latest: Mutex::new(start),
            finished: Mutex::new(None),
            over: Condvar::new(),
            thread: Mutex::new(None),
        }
    }

    /// Asks it to stop.
    pub(super) fn cancel(&self) {
        self.cancel.cancel();
    }

    /// Waits until it is over and its thread has ended.
    pub(super) fn finish(&self) {
        let running = |finished: &mut Option<_>| finished.is_none();
        drop(self.over.wait_while(lock(&self.finished), running).unwrap_or_else(PoisonError::into_inner));
        self.join();
    }

    /// A second caller waits for the first. The thread itself cannot panic.
    fn join(&self) {
        let mut thread = lock(&self.thread);
        if let Some(handle) = thread.take() {
            let _ = handle.join();
        }
    }

    /// What came of it; an error while it runs.
    pub(super) fn finished(&self) -> Result<Arc<Finished>, Failure> {
        let finished = lock(&self.finished).clone();
        finished.ok_or_else(|| self.running("the render is running"))
    }

    /// What came of it, or the image of its whole passes while it runs and after it failed, and their number.
    pub(super) fn so_far(&self, plane: Plane) -> Result<Result<Arc<Finished>, (Image, u32)>, Failure> {
        // A render that ends shows its film until it has finished.
        match (self.preview.image(plane)?, self.finished()) {
            (Some(so_far), Ok(finished)) if finished.result.is_err() => Ok(Err(so_far)),
            (_, Ok(finished)) => Ok(Ok(finished)),
            (Some(so_far), Err(_)) => Ok(Err(so_far)),
            (None, Err(_)) => Err(self.running("the render has no whole pass yet")),
        }
    }

    fn running(&self, text: &str) -> Failure {
        Failure::new(ERROR_WRONG_STATE, text).object(OBJECT_RENDER, self.id, "").expected()
    }

    /// The last relative standard error that was estimated.
    pub(super) fn noise(&self) -> f32 {
        lock(&self.latest).noise
    }

    /// The latest report, from now on; a poll between two of them may have told more.
    fn note(&self, report: render::Progress) -> render::Progress {
        let mut latest = lock(&self.latest);
        *latest = render::Progress {
            fraction: report.fraction.max(latest.fraction),
            samples: report.samples.max(latest.samples),
            rays: report.rays.max(latest.rays),
            elapsed: report.elapsed.max(latest.elapsed),
            noise: report.noise,
        };
        *latest
    }

    /// Renders on this thread and publishes what came of it as its last act.
    fn run(&self, request: Request, messages: &Messages) {
        let progress = |progress: render::Progress| {
            let progress = self.note(progress);
            if !request.report(self.id, &progress) {
                self.cancel.cancel();
            }
        };
        let result = guard::catch(|| {
            let (world, settings) = (&request.snapshot.world, &request.settings);
            render::render_shown(world, settings, &self.cancel, &progress, &self.preview).map_err(Failure::from)
        });
        let result = result.map_err(|failure| failure.object_if_none(OBJECT_RENDER, self.id, ""));
        let result = result.map_err(|failure| {
            messages.error(&failure);
            Failure { told: true, ..failure }
        });
        let Request { snapshot, settings, done, user, .. } = request;
        let code = match &result {
            Ok(output) if output.cancelled => CANCELLED,
            Ok(_) => OK,
            Err(failure) => failure.code,
        };
        let camera = settings.view.as_ref().or_else(|| snapshot.world.cameras.get(settings.camera));
        let finished = Finished {
            result,
            scene_hash: snapshot.world.hash(),
            camera: camera.map_or_else(String::new, |camera| camera.name.clone()),
            settings,
        };
        drop(snapshot);
        self.publish(finished);
        if let Some(done) = done {
            // SAFETY: the host promised a function of this type, which neither throws nor jumps out.
            guard::call_host(|| unsafe { done(user.0, Handle::new(self.id), code) });
        }
    }

    /// It is over.
    fn publish(&self, finished: Finished) {
        // A render that failed has no image but the one of its whole passes.
        let failed = finished.result.is_err();
        *lock(&self.finished) = Some(Arc::new(finished));
        if !failed {
            self.preview.close();
        }
        self.over.notify_all();
    }
}

impl Request {
    /// Tells the host; false if it wants no more.
    fn report(&self, render: u64, progress: &render::Progress) -> bool {
        let Some(callback) = self.progress else {
            return true;
        };
        let progress = to_host(render, progress, STATE_RUNNING);
        // SAFETY: the host promised a function of this type, which neither throws nor jumps out.
        guard::call_host(|| unsafe { callback(self.user.0, &progress) }) != 0
    }
}

fn to_host(render: u64, progress: &render::Progress, state: u32) -> Progress {
    Progress {
        struct_size: size_of::<Progress>() as u32,
        state,
        fraction: progress.fraction,
        samples: progress.samples,
        rays: progress.rays,
        elapsed_seconds: progress.elapsed.as_secs_f64(),
        noise: progress.noise,
        reserved: 0,
        render: Handle::new(render),
    }
}

guard::export! {
    /// Renders and returns when it is over.
    fn caustica_render(device, desc: In<RenderDesc>, render: Out<Handle<Render>>) = render_now;

    /// Starts a render and returns at once.
    fn caustica_render_start(device, desc: In<RenderDesc>, render: Out<Handle<Render>>) = start;

    /// Waits for its end.
    fn caustica_render_wait(device, render: Handle<Render>, timeout_seconds: f64) = wait;

    /// Gives it up; one that runs is cancelled and waited for.
    fn caustica_render_release(device, render: Handle<Render>) = release;
}

guard::export! {
    /// How far it is.
    callback_safe fn caustica_render_poll(device, render: Handle<Render>, progress: OutStruct<Progress>) = poll;

    /// Asks it to stop.
    callback_safe fn caustica_render_cancel(device, render: Handle<Render>) = cancel;

    /// How it ended.
    callback_safe fn caustica_render_result(device, render: Handle<Render>, statistics: OutStruct<Statistics>) = result;
}

fn render_now(device: &Arc<Device>, desc: In<RenderDesc>, render: Out<Handle<Render>>) -> Result<i32, Failure> {
    let out = render.required("render")?;
    let request = request(device, desc)?;
    let features = request.settings.features;
    let (handle, object) = device.renders.insert(|id| Render::new(id, features))?;
    object.run(request, &device.messages);
    match &object.finished()?.result {
        Ok(output) => {
            out.write(handle);
            Ok(if output.cancelled { CANCELLED } else { OK })
        }
        Err(failure) => {
            device.renders.remove(handle)?;
            Err(failure.clone())
        }
    }
}

fn start(device: &Arc<Device>, desc: In<RenderDesc>, render: Out<Handle<Render>>) -> Result<i32, Failure> {
    let out = render.required("render")?;
    let request = request(device, desc)?;
    let features = request.settings.features;
    let (handle, object) = device.renders.insert(|id| Render::new(id, features))?;
    let (worker, messages) = (object.clone(), device.messages.clone());
    // Held until the handle of the thread is stored, so that nobody finds a render without it.
    let mut thread = lock(&object.thread);
    let spawned = std::thread::Builder::new().name("caustica-render".to_owned()).spawn(move || {
        let _here = guard::Inside::enter();
        worker.run(request, &messages);
    });
    match spawned {
        Ok(handle) => *thread = Some(handle),
        Err(error) => {
            device.renders.remove(handle)?;
            return Err(Failure::limit("thread", format!("could not be started: {error}")));
        }
    }
    drop(thread);
    out.write(handle);
    Ok(OK)
}

fn wait(device: &Arc<Device>, render: Handle<Render>, timeout_seconds: f64) -> Result<i32, Failure> {
    let render = device.renders.get(render)?;
    if timeout_seconds.is_nan() {
        return Err(Failure::argument("timeout_seconds", "is NaN; seconds were expected, or less than 0 for ever"));
    }
    let timeout = Duration::try_from_secs_f64(timeout_seconds).ok();
    if let Some(timeout) = timeout {
        let running = |finished: &mut Option<_>| finished.is_none();
        let waited = render.over.wait_timeout_while(lock(&render.finished), timeout, running);
        let (finished, _) = waited.unwrap_or_else(PoisonError::into_inner);
        if finished.is_none() {
            return Ok(TIMEOUT);
        }
    }
    render.finish();
    Ok(OK)
}

fn poll(device: &Arc<Device>, render: Handle<Render>, progress: OutStruct<Progress>) -> Result<i32, Failure> {
    let place = progress.required("progress")?;
    let render = device.renders.get(render)?;
    let finished = lock(&render.finished).clone();
    let mut latest = *lock(&render.latest);
    // What the last report says may be old.
    if finished.is_none()
        && let Some((fraction, samples, noise)) = render.preview.progress()
    {
        latest = render.note(render::Progress { fraction: fraction.min(0.999), samples, noise, ..latest });
    }
    let state = match finished.as_deref().map(|finished| &finished.result) {
        None => STATE_RUNNING,
        Some(Ok(output)) => {
            // A cancelled render makes no last report.
            let statistics = &output.statistics;
            (latest.samples, latest.rays) = (statistics.samples, statistics.rays());
            latest.elapsed = Duration::from_secs_f64(statistics.render_seconds);
            if output.cancelled { STATE_CANCELLED } else { STATE_DONE }
        }
        Some(Err(_)) => STATE_FAILED,
    };
    place.write(&to_host(render.id, &latest, state));
    Ok(OK)
}

fn cancel(device: &Arc<Device>, render: Handle<Render>) -> Result<i32, Failure> {
    device.renders.get(render)?.cancel();
    Ok(OK)
}

fn result(device: &Arc<Device>, render: Handle<Render>, statistics: OutStruct<Statistics>) -> Result<i32, Failure> {
    let place = statistics.optional("statistics")?;
    let render = device.renders.get(render)?;
    match &render.finished()?.result {
        Ok(output) => {
            place.write(&Statistics::new(output, render.noise()));
            Ok(if output.cancelled { CANCELLED } else { OK })
        }
        Err(failure) => Err(failure.clone()),
    }
}

fn release(device: &Arc<Device>, render: Handle<Render>) -> Result<i32, Failure> {
    let object = device.renders.get(render)?;
    object.cancel();
    object.finish();
    device.renders.remove(render)?;
    Ok(OK)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Rgb;
    use crate::render::Integrator;
    use crate::scene::description::{self, Description, Projection};
    use crate::scene::{CommitOptions, World};

    #[test]
    fn a_render_that_failed_shows_the_passes_that_were_whole() {
        let projection = Projection::Perspective { yfov: 1.0 };
        let camera = description::Camera::new("", Default::default(), projection);
        let description = Description { environment: Rgb::ONE.into(), cameras: vec![camera], ..Description::default() };
        let world = World::commit(&description, CommitOptions::default()).unwrap();
        let settings =
            Settings { width: 4, height: 4, samples: 1 << 30, integrator: Integrator::Path, ..Settings::default() };
        let render = Render::new(1, false);
        let progress = |report: render::Progress| assert!(render.note(report).samples < 4, "enough");
        let result = render::render_shown(&world, &settings, &render.cancel, &progress, &render.preview);
        let result = result.map_err(Failure::from);
        assert!(result.is_err());
        render.publish(Finished { result, scene_hash: 0, camera: String::new(), settings });
        let (image, samples) = render.so_far(Plane::Radiance).unwrap().err().expect("an image");
        assert!(samples >= 4 && image.pixels.iter().all(|p| (p.x - 1.0).abs() < 1e-5));
        assert_eq!(render.finished().unwrap().output().err().map(|failure| failure.code), Some(ERROR_INTERNAL));
    }

    #[test]
    fn reports_do_not_go_back() {
        let render = Render::new(1, false);
        let report = |fraction, samples, rays| render::Progress {
            fraction,
            samples,
            rays,
            elapsed: Duration::from_secs(rays),
            noise: 0.5,
        };
        render.note(report(0.6, 7, 1));
        let seen = render.note(report(0.5, 6, 2));
        assert_eq!((seen.fraction, seen.samples, seen.rays, seen.elapsed.as_secs()), (0.6, 7, 2, 2));
        assert_eq!(render.note(report(0.7, 7, 1)).rays, 2);
    }
}
