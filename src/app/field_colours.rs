//! Polygons in the field's colours: its values at their corners are found on a thread of their own, again whenever the field, its
//! mode or a mesh is another.

use eframe::egui::Context;

use super::job::{Ended, Job};
use super::window::Window;
use crate::scene::{Look, MeshInField, Scene};
use crate::task::field_on_mesh::{FieldOnMeshError, Found, field_on_meshes};

/// Values that are being found.
pub(super) struct FieldColours {
    wanted: Vec<MeshInField>,
    job: Job<Result<Vec<Found>, FieldOnMeshError>>,
}

impl Window {
    /// Takes values that were found, and asks for those that polygons lack, in the mode on screen before the one that it is
    /// compared with.
    pub(super) fn colour_by_field(&mut self, ctx: &Context) {
        if let Some(ended) = self.field_colours.as_ref().and_then(|asked| asked.job.poll()) {
            self.field_colours = None;
            self.take_field_values(ended);
            // What was drawn lacks them.
            ctx.request_repaint();
        }
        let Some(scene) = &self.scene else {
            self.field_colours = None;
            return;
        };
        let lacks = |scene: &Scene| !scene.lacking_field_values().is_empty();
        let second = || Scene { splat: self.compare.second, ..scene.clone() };
        let lacking = match lacks(scene) {
            true => Some(scene.clone()),
            false => self.compare.on.then(second).filter(lacks),
        };
        let Some(scene) = lacking else {
            self.field_colours = None;
            return;
        };
        let wanted = scene.lacking_field_values();
        // Fields of other modes would be made side by side, as a hand drags what they depend on: one after the other, each with
        // all of memory. What is not wanted any more is told to end, and its end asks again.
        if let Some(asked) = &self.field_colours {
            if asked.wanted != wanted {
                asked.job.cancel();
            }
            return;
        }
        let job = Job::start("field-colours", "Colouring polygons", ctx, move |ticket| {
            field_on_meshes(&scene, ticket)
        });
        self.field_colours = Some(FieldColours { wanted, job });
    }

    fn take_field_values(&mut self, ended: Ended<Result<Vec<Found>, FieldOnMeshError>>) {
        let Some(scene) = &mut self.scene else { return };
        let refused = match ended {
            Ended::Finished(Ok(found)) => {
                for Found { values, told } in found {
                    scene.give_field_values(values);
                    if let Some(told) = told {
                        self.notices.hint(told);
                    }
                }
                return;
            }
            Ended::Finished(Err(FieldOnMeshError::Cancelled(_))) => return,
            Ended::Finished(Err(error)) => error.to_string(),
            Ended::Lost => "Colouring polygons stopped on a bug of the program".to_owned(),
        };
        // Nobody waits for it again and again.
        for layer in &mut scene.layers {
            if let Look::Polygons(look) = &mut layer.look {
                look.by_field = false;
            }
        }
        self.notices.error(refused);
    }
}
