//! Every command of the window, once: its name, its shortcut and what it is for.
//!
//! The menus, the keyboard and the cheat-sheet all read [`ACTIONS`].

use eframe::egui::{Context, Event, Key, KeyboardShortcut, Modifiers};

/// A command without further input.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[expect(missing_docs, reason = "ACTIONS says what each does")]
pub enum Action {
    Open,
    OpenFolder,
    OpenPath,
    RawLayout,
    EmbedPolygons,
    AddLabels,
    SavePicture,
    SaveScreenshot,
    LoadTransfer,
    SaveTransfer,
    Quit,
    Undo,
    Redo,
    CopyTransfer,
    PasteTransfer,
    ViewFront,
    ViewBack,
    ViewLeft,
    ViewRight,
    ViewTop,
    ViewBottom,
    ViewIsometric,
    RollLeft,
    RollRight,
    TurnUpsideDown,
    ToggleProjection,
    ResetView,
    FitView,
    PreviousView,
    NextView,
    Converge,
    ToggleLights,
    ToggleMaximum,
    ToggleFade,
    ShowFaded,
    ShowVectors,
    ToggleScalarBar,
    ToggleScaleBar,
    ToggleAxes,
    ToggleTrihedron,
    ToggleAnimation,
    AddSlice,
    AddIsosurface,
    ToggleClipBox,
    AddClipPlane,
    MakeStreamlines,
    AddLight,
    ToggleCells,
    ToggleLeveling,
    ToggleProbe,
    EndTools,
    ToggleSidePanel,
    ToggleAccuracy,
    ToggleEffects,
    ToggleCompare,
    ToggleDifference,
    Find,
    ToggleHelp,
    About,
}

impl Action {
    /// Whether a line parts it from what stands over it in its menu: another kind of command begins.
    pub fn begins_group(self) -> bool {
        use Action::*;
        matches!(
            self,
            SavePicture
                | MakeStreamlines
                | EmbedPolygons
                | LoadTransfer
                | Quit
                | RollLeft
                | ToggleProjection
                | ResetView
                | ToggleScalarBar
                | ToggleCells
                | ToggleSidePanel
                | ToggleCompare
        )
    }
}

/// The menu that an action stands in.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[expect(missing_docs, reason = "the names say it all")]
pub enum Menu {
    File,
    Edit,
    Add,
    View,
    Camera,
    Help,
}

/// One row of the table of commands.
#[derive(Debug, Clone, Copy)]
pub struct Entry {
    /// Which command.
    pub action: Action,
    /// Where it stands.
    pub menu: Menu,
    /// Its name, as in the menu.
    pub name: &'static str,
    /// Its key, if it has one.
    pub shortcut: Option<KeyboardShortcut>,
    /// What it does, one line.
    pub help: &'static str,
}

const fn plain(key: Key) -> Option<KeyboardShortcut> {
    Some(KeyboardShortcut::new(Modifiers::NONE, key))
}

const fn command(key: Key) -> Option<KeyboardShortcut> {
    Some(KeyboardShortcut::new(Modifiers::COMMAND, key))
}

const fn alternate(key: Key) -> Option<KeyboardShortcut> {
    Some(KeyboardShortcut::new(Modifiers::ALT, key))
}

const fn shifted(key: Key) -> Option<KeyboardShortcut> {
    Some(KeyboardShortcut::new(Modifiers::COMMAND.plus(Modifiers::SHIFT), key))
}

/// Further keys of commands that have one in [`ACTIONS`].
const SECOND_KEYS: [(Action, KeyboardShortcut); 1] =
    [(Action::Redo, KeyboardShortcut::new(Modifiers::COMMAND, Key::Y))];

const fn entry(
    action: Action,
    menu: Menu,
    name: &'static str,
    shortcut: Option<KeyboardShortcut>,
    help: &'static str,
) -> Entry {
    Entry { action, menu, name, shortcut, help }
}

/// Every command there is, in the order of the menus.
pub const ACTIONS: [Entry; 59] = [
    entry(Action::Open, Menu::File, "Open…", command(Key::O), "Open a volume in a file dialog"),
    entry(
        Action::OpenFolder,
        Menu::File,
        "Open folder…",
        None,
        "Open a DICOM series, a Zarr folder, or a folder of pictures as slices",
    ),
    entry(
        Action::OpenPath,
        Menu::File,
        "Open path…",
        command(Key::L),
        "Open a volume by typing its path, or demo:NAME",
    ),
    entry(
        Action::RawLayout,
        Menu::File,
        "Raw layout…",
        None,
        "Say how the samples lie in the open file: size, number type, byte order",
    ),
    entry(
        Action::SavePicture,
        Menu::File,
        "Save picture…",
        command(Key::S),
        "Draw the view at any size and save it",
    ),
    entry(
        Action::SaveScreenshot,
        Menu::File,
        "Save screenshot",
        plain(Key::F12),
        "Save what is on screen to the pictures folder: the picture and its annotations",
    ),
    entry(
        Action::LoadTransfer,
        Menu::File,
        "Load transfer function…",
        None,
        "Take opacities and colours from a file; a file dropped on the window is loaded, too",
    ),
    entry(
        Action::SaveTransfer,
        Menu::File,
        "Save transfer function…",
        None,
        "Keep opacities and colours as a file, in the data's own units",
    ),
    entry(Action::Quit, Menu::File, "Quit", command(Key::Q), "Close the window"),
    entry(
        Action::Undo,
        Menu::Edit,
        "Undo",
        command(Key::Z),
        "Take back the last change; views have steps of their own (Alt+Left)",
    ),
    entry(
        Action::Redo,
        Menu::Edit,
        "Redo",
        shifted(Key::Z),
        "Do again what was taken back last (Ctrl+Y, too)",
    ),
    entry(
        Action::CopyTransfer,
        Menu::Edit,
        "Copy transfer function",
        None,
        "Put opacities and colours on the clipboard, as text (Ctrl+C)",
    ),
    entry(
        Action::PasteTransfer,
        Menu::Edit,
        "Paste transfer function",
        None,
        "Take opacities and colours from the clipboard (Ctrl+V)",
    ),
    entry(
        Action::AddSlice,
        Menu::Add,
        "Slice",
        None,
        "A plane through the middle that shows the values on it in their colours; Surfaces and slices, in the side panel, moves it",
    ),
    entry(
        Action::AddIsosurface,
        Menu::Add,
        "Isosurface",
        None,
        "A surface where the values pass a level; Surfaces and slices, in the side panel, sets it",
    ),
    entry(
        Action::ToggleClipBox,
        Menu::Add,
        "Clip box",
        None,
        "Keep a part of the volume: drag the handles on the box's faces",
    ),
    entry(
        Action::AddClipPlane,
        Menu::Add,
        "Clip plane",
        None,
        "Cut away what lies before a plane through the middle; Clip, in the side panel, turns and moves it",
    ),
    entry(
        Action::MakeStreamlines,
        Menu::Add,
        "Streamlines",
        None,
        "Tubes along the vectors that are shown; Vectors, in the side panel, says how many and where",
    ),
    entry(
        Action::AddLight,
        Menu::Add,
        "Light",
        None,
        "One more light, from the right; Shading, in the side panel, turns and colours it",
    ),
    entry(
        Action::EmbedPolygons,
        Menu::Add,
        "Add polygons…",
        None,
        "Show the triangles of an STL, PLY or OBJ file within the volume",
    ),
    entry(
        Action::AddLabels,
        Menu::Add,
        "Add labels…",
        None,
        "Show a segmentation of the open volume over it: a surface and a colour for each label",
    ),
    entry(Action::ViewFront, Menu::Camera, "Front", plain(Key::Num1), "Look at the front"),
    entry(Action::ViewBack, Menu::Camera, "Back", command(Key::Num1), "Look at the back"),
    entry(
        Action::ViewRight,
        Menu::Camera,
        "Right",
        plain(Key::Num3),
        "Look at the right side: of a patient the patient's own",
    ),
    entry(
        Action::ViewLeft,
        Menu::Camera,
        "Left",
        command(Key::Num3),
        "Look at the left side: of a patient the patient's own",
    ),
    entry(Action::ViewTop, Menu::Camera, "Top", plain(Key::Num7), "Look from above"),
    entry(Action::ViewBottom, Menu::Camera, "Bottom", command(Key::Num7), "Look from below"),
    entry(
        Action::ViewIsometric,
        Menu::Camera,
        "Isometric",
        plain(Key::Num9),
        "Look from the front, the right and above at once",
    ),
    entry(
        Action::RollLeft,
        Menu::Camera,
        "Roll left",
        plain(Key::Num4),
        "Turn the picture a quarter to the left",
    ),
    entry(
        Action::RollRight,
        Menu::Camera,
        "Roll right",
        plain(Key::Num6),
        "Turn the picture a quarter to the right",
    ),
    entry(
        Action::TurnUpsideDown,
        Menu::Camera,
        "Turn upside down",
        plain(Key::Num8),
        "Swap up and down, in this view and in all others: for data that stand on their head",
    ),
    entry(
        Action::ToggleProjection,
        Menu::Camera,
        "Perspective",
        plain(Key::Num5),
        "What is near looks larger; switched off, rays are parallel (orthographic)",
    ),
    entry(
        Action::ResetView,
        Menu::Camera,
        "Reset view",
        plain(Key::Enter),
        "Show all that can be seen, as when it was opened",
    ),
    entry(
        Action::FitView,
        Menu::Camera,
        "Fit to window",
        plain(Key::F),
        "Show all that can be seen from where you look, as large as it fits",
    ),
    entry(
        Action::PreviousView,
        Menu::Camera,
        "Previous view",
        alternate(Key::ArrowLeft),
        "Look again from where you looked before; nothing else changes",
    ),
    entry(
        Action::NextView,
        Menu::Camera,
        "Next view",
        alternate(Key::ArrowRight),
        "Look from where you looked before you went back",
    ),
    entry(
        Action::Converge,
        Menu::View,
        "Refine until converged",
        plain(Key::R),
        "Draw the view at rest in ever thinner steps along the rays (slabs) until nothing changes, however long that takes",
    ),
    entry(
        Action::ToggleAnimation,
        Menu::View,
        "Play animation",
        plain(Key::Space),
        "Let the marks of vectors move along the flow, or stop them where they are",
    ),
    entry(Action::ToggleLights, Menu::View, "Lights", plain(Key::L), "Switch the lights on or off"),
    entry(
        Action::ToggleMaximum,
        Menu::View,
        "Maximum (MIP)",
        plain(Key::M),
        "Show the greatest value on each line of sight, or the volume again; Rendering, on top of the side panel, has the mean and the least",
    ),
    entry(
        Action::ToggleFade,
        Menu::View,
        "Fade the volume",
        None,
        "Draw the volume with a small part of its opacities, so that what lies inside it is seen, or with all of them again",
    ),
    entry(
        Action::ShowFaded,
        Menu::View,
        "Show the volume again",
        None,
        "Draw the volume, which was faded, with all of its opacities again",
    ),
    entry(
        Action::ShowVectors,
        Menu::View,
        "Show the vectors",
        None,
        "Draw the first vectors of the file beside its values; Vectors, in the side panel, has the others",
    ),
    entry(
        Action::ToggleScalarBar,
        Menu::View,
        "Scalar bar",
        plain(Key::B),
        "Show or hide which colour is which value, and how opaque",
    ),
    entry(
        Action::ToggleScaleBar,
        Menu::View,
        "Scale bar",
        plain(Key::S),
        "Show or hide a round length in the file's units",
    ),
    entry(
        Action::ToggleAxes,
        Menu::View,
        "Axes",
        plain(Key::X),
        "Show or hide the box around the volume, with where it lies in the world",
    ),
    entry(
        Action::ToggleTrihedron,
        Menu::View,
        "Trihedron",
        plain(Key::T),
        "Show or hide the directions of the world's axes",
    ),
    entry(
        Action::ToggleCells,
        Menu::View,
        "Octree cells",
        plain(Key::G),
        "Show where the octree is fine and where coarse; rest on a cell to see why",
    ),
    entry(
        Action::ToggleLeveling,
        Menu::View,
        "Window and level",
        plain(Key::W),
        "Left drags change the range of the colours: across its width, up and down its middle",
    ),
    entry(
        Action::ToggleProbe,
        Menu::View,
        "Probe",
        plain(Key::P),
        "Say what is under the cursor at rest: place, value, gradient and opacity",
    ),
    entry(
        Action::EndTools,
        Menu::View,
        "End tools",
        plain(Key::Escape),
        "End the probe, window and level and the octree's cells, and take errors and effects off the picture",
    ),
    entry(
        Action::ToggleSidePanel,
        Menu::View,
        "Side panel",
        plain(Key::F9),
        "Show or hide the side panel",
    ),
    entry(
        Action::ToggleAccuracy,
        Menu::View,
        "Accuracy panel",
        plain(Key::A),
        "Show or hide the chart of time against error, measured while the view rests",
    ),
    entry(
        Action::ToggleEffects,
        Menu::View,
        "Effects panel",
        plain(Key::E),
        "Show or hide the list of effects: which run, why, and what they cost",
    ),
    entry(
        Action::ToggleCompare,
        Menu::View,
        "Compare two modes",
        plain(Key::C),
        "Show the view in a second mode beside the first",
    ),
    entry(
        Action::ToggleDifference,
        Menu::View,
        "Show the difference",
        plain(Key::D),
        "Show how far two compared modes are apart, amplified, instead of both side by side",
    ),
    entry(
        Action::Find,
        Menu::Help,
        "Find…",
        command(Key::F),
        "Find a command or a setting by its name, or by what other programs call it",
    ),
    entry(
        Action::ToggleHelp,
        Menu::Help,
        "Keys and mouse",
        plain(Key::H),
        "Show or hide this list of all keys and mouse buttons",
    ),
    entry(
        Action::About,
        Menu::Help,
        "About Voxsplat",
        None,
        "Its version, what draws, and the papers that it draws by",
    ),
];

/// What the mouse does in the viewport: the gesture, and its effect.
pub const GESTURES: [(&str, &str); 12] = [
    ("Left drag", "Turn the volume"),
    ("Ctrl+left drag", "Roll: turn the picture about its middle"),
    ("W, then left drag", "Change window (across) and level (up and down)"),
    ("Middle drag, Shift+left drag", "Move the volume"),
    ("Right drag", "Zoom: up comes closer"),
    ("Wheel", "Zoom to the cursor"),
    ("Double click", "Put what is under the cursor in the centre"),
    ("Click on an end of the trihedron", "Look along that axis"),
    ("Drop a file", "Open the volume, or load the transfer function"),
    ("Ctrl+C, Ctrl+V", "Copy, paste the transfer function"),
    ("Drag the line between two modes", "Show more of the one or the other"),
    ("Click, Shift+click on the chart", "Draw with a mode, compare with it"),
];

/// The row of an action.
pub fn entry_of(action: Action) -> &'static Entry {
    // The test below holds that every action has its row.
    ACTIONS.iter().find(|e| e.action == action).unwrap_or(&ACTIONS[0])
}

/// The commands whose keys were pressed since the last pass; their key presses are used up.
///
/// Keys that a focused text field needs are left to it, its own undo among them, and Enter to any
/// focused widget; Escape is left to others unless it `ends_tools`. Behind a dialog keys without a modifier are its own.
pub fn pressed(ctx: &Context, ends_tools: bool, behind_dialog: bool) -> Vec<Action> {
    let typing = ctx.text_edit_focused();
    let focused = ctx.memory(|memory| memory.focused().is_some());
    let available = |shortcut: &KeyboardShortcut| {
        let activates_widgets = matches!(shortcut.logical_key, Key::Enter | Key::Space);
        let is_undo = matches!(shortcut.logical_key, Key::Z | Key::Y);
        let is_taken = typing && (is_undo || shortcut.conflicts_with_text_editing())
            || shortcut.logical_key == Key::Escape && !ends_tools
            || behind_dialog && shortcut.modifiers.is_none() && shortcut.logical_key != Key::Escape;
        !(is_taken || focused && activates_widgets)
    };
    let keys = ACTIONS.iter().filter_map(|e| Some((e.action, e.shortcut?))).chain(SECOND_KEYS);
    let mut keys: Vec<_> = keys.collect();
    // A shortcut matches with Shift held, too, so those that ask for it come first.
    keys.sort_by_key(|(_, shortcut)| !shortcut.modifiers.shift);
    keys.into_iter()
        .filter(|(_, shortcut)| available(shortcut))
        .filter(|(_, shortcut)| ctx.input_mut(|input| input.consume_shortcut(shortcut)))
        .map(|(action, _)| action)
        .collect()
}

/// Where a key of this pass asks for a dialog, takes away the keys without a modifier that were pressed after it: they
/// are meant for what is still to come. What they typed stays as text.
pub fn leave_to_dialog(ctx: &Context) {
    let asks_for_more = ACTIONS.iter().filter(|entry| entry.name.ends_with('…'));
    let shortcuts: Vec<_> = asks_for_more.filter_map(|entry| entry.shortcut).collect();
    ctx.input_mut(|input| {
        let mut is_asked = false;
        input.events.retain(|event| {
            let Event::Key { key, pressed: true, modifiers, .. } = event else { return true };
            let is_plain = modifiers.is_none() || modifiers.shift_only();
            let is_kept = !(is_asked && is_plain);
            is_asked |= shortcuts.iter().any(|shortcut| {
                shortcut.logical_key == *key && modifiers.matches_logically(shortcut.modifiers)
            });
            is_kept
        });
    });
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_two_actions_share_a_name_or_a_key() {
        for (i, a) in ACTIONS.iter().enumerate() {
            for b in &ACTIONS[i + 1..] {
                assert_ne!(a.action, b.action);
                assert_ne!(a.name, b.name);
                assert!(a.shortcut.is_none() || a.shortcut != b.shortcut, "{} {}", a.name, b.name);
            }
            assert_eq!(entry_of(a.action).name, a.name);
        }
    }

    #[test]
    fn help_is_one_line_without_a_full_stop() {
        for e in &ACTIONS {
            assert!(!e.help.ends_with('.') && !e.help.contains('\n'), "{}", e.help);
            let asks_for_more = e.name.ends_with('…');
            let opens_dialog = matches!(
                e.action,
                Action::Open
                    | Action::OpenFolder
                    | Action::OpenPath
                    | Action::RawLayout
                    | Action::EmbedPolygons
                    | Action::AddLabels
                    | Action::SavePicture
                    | Action::LoadTransfer
                    | Action::SaveTransfer
                    | Action::Find
            );
            assert_eq!(asks_for_more, opens_dialog, "{}", e.name);
        }
    }
}
