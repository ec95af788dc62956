//! Panics that are caught and told as errors.

use std::cell::Cell;
use std::panic::{AssertUnwindSafe, catch_unwind};

thread_local! {
    static ARE_CAUGHT: Cell<bool> = const { Cell::new(false) };
}

/// Whether a panic of the current thread is told by who catches it: a hook that reports panics leaves it alone.
pub fn are_caught() -> bool {
    ARE_CAUGHT.get()
}

/// Does something that may panic in a library, whose state is not used after that.
///
/// # Errors
/// The words of the panic.
pub fn caught<T>(work: impl FnOnce() -> T) -> Result<T, String> {
    let before = ARE_CAUGHT.replace(true);
    let done = catch_unwind(AssertUnwindSafe(work));
    ARE_CAUGHT.set(before);
    done.map_err(|panic| {
        let words = panic.downcast_ref::<String>().cloned();
        let words = words.or_else(|| panic.downcast_ref::<&str>().map(|&words| words.to_owned()));
        words.unwrap_or_else(|| "a panic without words".to_owned())
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_panic_becomes_words_and_those_after_it_are_nobodys() {
        assert_eq!(caught(|| 3), Ok(3));
        // Unwound without the hook, which would print it.
        let raised = || -> () { std::panic::resume_unwind(Box::new("Error in Device::poll")) };
        assert_eq!(caught(raised), Err("Error in Device::poll".to_owned()));
        assert_eq!(caught(are_caught), Ok(true));
        assert!(!are_caught());
    }
}
