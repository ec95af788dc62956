//! Encoding the open field as basis functions, on a thread of its own, and what comes of it: the functions beside their
//! samples, and what they leave of these as a field.

use std::ops::ControlFlow;
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

use eframe::egui::Context;

use super::dialogs::named_file::Purpose;
use super::document::{Document, EncodedField};
use super::job::{Ended, Job};
use super::panels::data::FieldChoice;
use super::saving::{self, Written};
use super::window::Window;
use super::words;
use crate::core::Ticket;
use crate::io::{Encoded, vrbf};
use crate::rbf::{Basis, Errors, Favour, Region, Step};
use crate::scene::SplatSettings;
use crate::task::encode::{Asked, FieldError, Wanted, encode_field, residual, usual_functions};
use crate::task::output_file::OutputFile;
use crate::volume::{Component, Field, Grid, ScalarVolume};

/// The fewest functions that may be asked for.
pub(super) const LEAST_FUNCTIONS: u32 = 4;
/// Functions at most where nobody has said how many.
const MOST_AT_FIRST: u32 = 2000;

/// What ends an encoding.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum EncodeGoal {
    /// The greatest error.
    #[default]
    Greatest,
    /// The mean error.
    Mean,
    /// As many functions as a file of a size holds.
    Bytes,
}

impl EncodeGoal {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Greatest, Self::Mean, Self::Bytes];
}

/// What a field is encoded by.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EncodeChoice {
    /// What ends it, beside the number of functions.
    pub goal: EncodeGoal,
    /// The error, % of the values' range.
    pub percent: f64,
    /// The most kilobytes of a file.
    pub kilobytes: u32,
    /// Functions at most; `None`: as many as the field is usually encoded by.
    pub functions: Option<u32>,
    /// What they look like.
    pub basis: Basis,
    /// Two values between which samples count more.
    pub favoured: Option<[f64; 2]>,
    /// Samples in the clip box count more, where there is one; with both those that are of both.
    pub favours_clip_box: bool,
    /// How many times as much they count.
    pub times: f64,
}

impl Default for EncodeChoice {
    fn default() -> Self {
        Self {
            goal: EncodeGoal::default(),
            percent: 2.0,
            kilobytes: 20,
            functions: None,
            basis: Basis::default(),
            favoured: None,
            favours_clip_box: false,
            times: Favour::TIMES,
        }
    }
}

impl EncodeChoice {
    /// Functions at most: as many as were chosen, or as the field is usually encoded by, within bounds.
    pub(super) fn most_functions(&self, document: &Document) -> u32 {
        let field = &document.grid.fields[document.field];
        let usual = usual_functions(field.samples.len() / field.components);
        let usual = u32::try_from(usual).unwrap_or(MOST_AT_FIRST);
        self.functions.unwrap_or(usual.clamp(LEAST_FUNCTIONS, MOST_AT_FIRST))
    }

    /// What is asked for by so many functions, with the samples in a region where that is to be favoured.
    fn asked(&self, functions: u32, region: Option<Region>) -> Asked {
        let of_goal =
            |goal: EncodeGoal| (goal == self.goal).then_some(Wanted::Percent(self.percent));
        let bytes = u64::from(self.kilobytes) * 1000;
        let range = self.favoured.map(|[a, b]| [a.min(b), a.max(b)]);
        let region = region.filter(|_| self.favours_clip_box);
        let is_favouring = range.is_some() || region.is_some();
        Asked {
            basis: self.basis,
            max_error: of_goal(EncodeGoal::Greatest),
            mean_error: of_goal(EncodeGoal::Mean),
            bytes: (self.goal == EncodeGoal::Bytes).then_some(bytes),
            functions: functions as usize,
            favour: is_favouring.then_some(Favour { times: self.times, range, region }),
        }
    }
}

/// What a thread that encodes and the window tell each other.
#[derive(Debug, Default)]
struct Talk {
    /// How far it came, round by round.
    steps: Mutex<Vec<Step>>,
    /// It is to end with the best that it has.
    is_enough: AtomicBool,
}

/// What it makes.
type Made = Result<(Encoded, Field), FieldError>;

/// A field that is being encoded.
#[derive(Debug)]
pub(super) struct Encoding {
    pub(super) job: Job<Made>,
    talk: Arc<Talk>,
    /// Of the document's fields, and which number of it.
    volume: Arc<ScalarVolume>,
    /// The range of its values.
    range: f64,
    /// What ends it.
    goal: EncodeGoal,
    /// The fit that it goes on from.
    earlier: Option<Arc<Encoded>>,
}

impl Encoding {
    /// What ends it.
    pub(super) fn goal(&self) -> EncodeGoal {
        self.goal
    }

    /// How far it came, round by round: functions, and the greatest error as a share of the values' range, or the mean one where
    /// that is the goal.
    pub(super) fn steps(&self) -> Vec<(usize, f64)> {
        let steps = self.talk.steps.lock().unwrap_or_else(PoisonError::into_inner);
        let error = |step: &Step| match self.goal {
            EncodeGoal::Greatest | EncodeGoal::Bytes => step.errors.max,
            EncodeGoal::Mean => step.errors.mean,
        };
        let share = |step: &Step| (step.functions, error(step) / self.range);
        steps.iter().map(share).collect()
    }

    pub(super) fn is_paused(&self) -> bool {
        self.job.is_paused()
    }

    pub(super) fn pause(&mut self, paused: bool) {
        self.job.pause(paused);
    }

    /// Ends it with the best that it has.
    pub(super) fn end(&mut self) {
        self.talk.is_enough.store(true, Ordering::Relaxed);
        self.pause(false);
    }
}

/// What a person asks of an encoding.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum EncodingRequest {
    /// Begin.
    Encode,
    /// Go on from the functions that the field was encoded by.
    Continue,
    /// Wait, or go on.
    Pause(bool),
    /// End with the best so far.
    Enough,
    /// Forget it.
    Cancel,
    /// Show the functions and the samples side by side.
    Compare,
    /// Show what the functions leave of the samples.
    Residual,
    /// Write the functions to a file.
    Save,
}

impl Window {
    /// Does what is asked of an encoding.
    pub(super) fn encode(&mut self, ctx: &Context, request: EncodingRequest) {
        match request {
            EncodingRequest::Encode => self.start_encoding(ctx, None),
            EncodingRequest::Continue => {
                let earlier = self.document.as_ref().and_then(Document::encoded_here).cloned();
                self.start_encoding(ctx, earlier);
            }
            EncodingRequest::Pause(paused) => {
                self.encoding.iter_mut().for_each(|encoding| encoding.pause(paused));
            }
            EncodingRequest::Enough => self.encoding.iter_mut().for_each(Encoding::end),
            EncodingRequest::Cancel => self.encoding = None,
            EncodingRequest::Compare => self.compare_with_samples(),
            EncodingRequest::Residual => {
                if let Some(field) = self.document.as_ref().and_then(Document::residual) {
                    // It has no functions to be compared with.
                    self.compare.on = false;
                    let component = Component::Index(0);
                    self.choose_field(ctx, FieldChoice { field, component });
                }
            }
            EncodingRequest::Save => {
                let path = self.suggested_encoding_path();
                self.ask_for_file(Purpose::SaveEncoding, &path);
            }
        }
    }

    /// Encodes the field on screen: from nothing, or from an earlier fit of it on.
    fn start_encoding(&mut self, ctx: &Context, earlier: Option<Arc<Encoded>>) {
        let Some(document) = &self.document else { return };
        let bounds = self.scene.as_ref().and_then(|scene| scene.inside.clip.bounds);
        let region = bounds.map(|bounds| bounds.region(&document.volume.lattice));
        let most_functions = self.encode_choice.most_functions(document);
        let mut asked = self.encode_choice.asked(most_functions, region);
        // A fit goes on with what it favoured.
        let before = earlier.as_ref().and_then(|earlier| earlier.source.favour);
        asked.favour = before.or(asked.favour);
        let goal = self.encode_choice.goal;
        let (grid, component) = (Arc::clone(&document.grid), document.component);
        let (field, volume) = (document.field, Arc::clone(&document.volume));
        let range = volume.statistics.max - volume.statistics.min;
        let name = document.source.name();
        let talk = Arc::new(Talk::default());
        let told = {
            let (talk, ctx) = (Arc::clone(&talk), ctx.clone());
            move |step: Step, ticket: &Ticket| {
                talk.steps.lock().unwrap_or_else(PoisonError::into_inner).push(step);
                ctx.request_repaint();
                // Of a cancel the encoder learns by itself.
                ticket.rest().ok();
                match talk.is_enough.load(Ordering::Relaxed) {
                    true => ControlFlow::Break(()),
                    false => ControlFlow::Continue(()),
                }
            }
        };
        let title = format!("Encoding {}", volume.name);
        let start = earlier.clone();
        let job = Job::start("encode", title, ctx, move |ticket| {
            let what = (&*grid, &grid.fields[field], component);
            let start = start.as_deref();
            let told = |step| told(step, ticket);
            let encoded = encode_field(what, &name, asked, start, ticket, told)?;
            let left = residual(what, &encoded.encoding, ticket)?;
            Ok((encoded, left))
        });
        self.encoding = Some(Encoding { job, talk, volume, range, goal, earlier });
    }

    /// Puts functions beside the samples that they were fitted to, and shows them.
    pub(super) fn take_encoding(&mut self) {
        let Some(ended) = self.encoding.as_ref().and_then(|encoding| encoding.job.poll()) else {
            return;
        };
        let Some(Encoding { job, volume, earlier, .. }) = self.encoding.take() else { return };
        let (Some(document), Some(scene)) = (&mut self.document, &mut self.scene) else { return };
        let is_of = Arc::ptr_eq(&document.volume, &volume);
        match ended {
            // Of a field that is not open any more.
            _ if job.is_cancelled() || !is_of => {}
            Ended::Finished(Ok((encoded, left))) => {
                let functions = Some(Arc::new(encoded.encoding.clone()));
                let volume = Arc::new(ScalarVolume { functions, ..(*document.volume).clone() });
                document.volume = Arc::clone(&volume);
                let mut fields = document.grid.fields.clone();
                // In the place of what an earlier encoding left.
                fields.truncate(document.fields_in_file);
                fields.push(left);
                document.grid = Arc::new(Grid { fields, ..(*document.grid).clone() });
                scene.set_volume(volume);
                let unit = scene.splat.opacity_unit_distance;
                scene.splat =
                    SplatSettings { opacity_unit_distance: unit, ..SplatSettings::FUNCTIONS };
                self.notices.settle();
                self.notices.hint(told_of(&encoded, earlier.as_deref()));
                let (field, component) = (document.field, document.component);
                let encoded = Arc::new(encoded);
                document.encoded = Some(EncodedField { field, component, encoded });
            }
            Ended::Finished(Err(FieldError::Cancelled(_))) => {}
            Ended::Finished(Err(error)) => self.notices.error(error.to_string()),
            Ended::Lost => self.notices.error("Encoding stopped on a bug of the program"),
        }
    }

    /// The functions in the mode on screen, what they were fitted to as the second: cells, points, or samples by splines.
    fn compare_with_samples(&mut self) {
        let Some(scene) = &mut self.scene else { return };
        let unit = scene.splat.opacity_unit_distance;
        let with_unit = |mode| SplatSettings { opacity_unit_distance: unit, ..mode };
        let own = scene.volume().and_then(|volume| SplatSettings::of_cells_or_points(volume));
        let own = own.unwrap_or(SplatSettings::EXACT);
        scene.splat = with_unit(SplatSettings::FUNCTIONS);
        self.compare.with(with_unit(own));
    }

    /// Beside the file, or with the pictures where there is none.
    fn suggested_encoding_path(&self) -> PathBuf {
        let path = self.suggested_transfer_path();
        let name = self.document.as_ref().map(|document| document.source.name());
        path.with_file_name(format!("{}.vrbf", saving::file_stem(&name.unwrap_or_default())))
    }

    /// Writes the functions to a file.
    pub(super) fn save_encoding(&mut self, ctx: &Context, path: PathBuf) {
        let encoded = self.document.as_ref().and_then(|document| document.encoded_here().cloned());
        let Some(encoded) = encoded else { return };
        self.saving.push(Job::start("save-encoding", "Saving the functions", ctx, move |_| {
            let bytes = vrbf::bytes(&encoded)?;
            OutputFile::check(&path, "the functions")?.write(&bytes)?;
            Ok(Written::of(&path, None))
        }));
    }
}

/// What came of it, for people: how near it is, what errors at samples do not tell, and of an `earlier` fit also whether nothing
/// was added to that.
fn told_of(encoded: &Encoded, earlier: Option<&Encoded>) -> String {
    let functions = encoded.encoding.functions();
    let plural = if functions.len() == 1 { "" } else { "s" };
    let count = words::count(functions.len() as u64);
    let errors = |errors: &Errors| {
        let [max, mean] = [errors.max, errors.mean].map(words::value);
        format!("greatest error {max}, mean {mean}")
    };
    let favoured = match &encoded.favoured {
        Some(favoured) => format!(". Of the favoured samples: {}", errors(favoured)),
        None => String::new(),
    };
    let told = format!("{count} basis function{plural}: {}{favoured}", errors(&encoded.errors));
    let is_as_it_was = earlier.is_some_and(|earlier| earlier.encoding.functions() == functions);
    let wanted = match (encoded.source.wanted, encoded.source.wanted_mean) {
        (Some(error), _) => Some(("greatest", words::value(error))),
        (None, Some(error)) => Some(("mean", words::value(error))),
        (None, None) => None,
    };
    let told = match (encoded.is_as_near_as_asked_for(), is_as_it_was, wanted) {
        (true, false, _) => told,
        (true, true, Some(_)) => format!("{told}. They are as near as was asked for already"),
        (_, true, _) => format!("{told}. Nothing nearer was found"),
        (false, false, Some((which, error))) => match encoded.ended {
            Some(_) => format!("{told}. A {which} error of {error} was not reached"),
            None => format!("{told}. A {which} error of {error} takes more functions"),
        },
        (false, false, None) => told,
    };
    let beyond = encoded.told_left_out().into_iter().chain(encoded.told_beyond_samples());
    let beyond: String =
        beyond.map(|sentence| format!(". {}", words::capital(&sentence))).collect();
    told + &beyond
}
