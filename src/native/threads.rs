//! The threads that draw.

use std::sync::OnceLock;

/// Threads of its own: those that others share their work out to may be busy with what takes seconds. Made when there
/// is something to draw.
#[derive(Debug)]
pub(super) struct Threads {
    /// See [`Threads::new`].
    count: usize,
    /// `None` where they did not start: then those that all share.
    pool: OnceLock<Option<rayon::ThreadPool>>,
}

impl Threads {
    /// So many; 0: as many as there are cores, or as `RAYON_NUM_THREADS` says.
    pub(super) fn new(count: usize) -> Self {
        Self { count, pool: OnceLock::new() }
    }

    /// Has work shared out to them.
    pub(super) fn run<T: Send>(&self, work: impl FnOnce() -> T + Send) -> T {
        let pool = self.pool.get_or_init(|| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(self.count);
            let pool = pool.thread_name(|i| format!("voxsplat-native-{i}"));
            let pool = pool.start_handler(|_| give_way()).build();
            pool.inspect_err(|error| log::warn!("no threads for drawing alone: {error}")).ok()
        });
        match pool {
            Some(pool) => pool.install(work),
            None => work(),
        }
    }
}

/// How much less of a core that is wanted by others, too, a thread that draws gets: a third of what they get.
#[cfg(target_os = "linux")]
const NICENESS: i32 = 5;

/// Has this thread give way to the interface's, which has little to do and is waited for.
#[cfg(target_os = "linux")]
fn give_way() {
    // On Linux it is of the calling thread alone; elsewhere of the process, whose interface would give way, too.
    if let Err(error) = rustix::process::nice(NICENESS) {
        log::debug!("threads for drawing share evenly with others: {error}");
    }
}

#[cfg(not(target_os = "linux"))]
fn give_way() {}

#[cfg(all(test, target_os = "linux"))]
mod tests {
    use rustix::process::getpriority_process;

    use super::*;

    #[test]
    fn threads_that_draw_give_way_and_whoever_has_them_draw_does_not() {
        let own = || getpriority_process(None).expect("a priority");
        let (before, threads) = (own(), Threads::new(2));
        let drawing = threads.run(|| rayon::broadcast(|_| own()));
        assert_eq!(drawing, [(before + NICENESS).min(19); 2]);
        assert_eq!(own(), before);
    }
}
