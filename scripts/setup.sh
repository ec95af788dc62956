# shellcheck shell=bash
# What ./run and ./test need of the machine. Sourced; it installs only what is missing, says what
# it installs, and does nothing quickly where everything is there.

say() { printf 'voxsplat: %s\n' "$*" >&2; }

fail() {
    say "$*"
    exit 1
}

have() { command -v "$1" >/dev/null 2>&1; }

is_linux() { [ "$(uname -s)" = Linux ]; }

as_root() {
    if [ "$(id -u)" -eq 0 ]; then
        "$@"
    elif have sudo; then
        sudo "$@"
    else
        fail "expected root or sudo to install packages, found neither; run as root: $*"
    fi
}

# Packages still to be installed, filled by the need_ functions.
missing_packages=()

# need_command COMMAND PACKAGE
need_command() {
    have "$1" || missing_packages+=("$2")
}

# need_library FILE PACKAGE: FILE as the dynamic linker knows it.
need_library() {
    case "$loadable_libraries" in
        *"$1"*) ;;
        *) missing_packages+=("$2") ;;
    esac
}

list_libraries() {
    loadable_libraries=$(PATH="$PATH:/sbin:/usr/sbin" ldconfig -p 2>/dev/null || true)
}

# has_vulkan_driver PATTERN: whether a driver's manifest matches.
has_vulkan_driver() {
    local folder
    for folder in /usr/share/vulkan/icd.d /usr/local/share/vulkan/icd.d /etc/vulkan/icd.d \
        "${XDG_DATA_HOME:-$HOME/.local/share}/vulkan/icd.d"; do
        compgen -G "$folder/$1" >/dev/null && return 0
    done
    return 1
}

# A compiler that links, and what rustup is fetched with.
need_build_tools() {
    need_command cc build-essential
    if ! find_cargo && ! have curl; then
        missing_packages+=(curl ca-certificates)
    fi
}

# Whether the system has a graphics processor's node: what draws without one needs no driver.
has_gpu() { compgen -G '/dev/dri/render*' >/dev/null || [ -e /dev/nvidiactl ] || [ -e /dev/dxg ]; }

# What the window and the engine load when they start, where a graphics adapter draws.
need_graphics() {
    list_libraries
    need_library libvulkan.so.1 libvulkan1
    if [ -z "${VK_DRIVER_FILES:-}${VK_ICD_FILENAMES:-}" ] && ! has_vulkan_driver '*.json'; then
        missing_packages+=(mesa-vulkan-drivers)
    fi
    need_window
}

# What every window loads.
need_window() {
    list_libraries
    need_library libX11.so.6 libx11-6
    need_library libX11-xcb.so.1 libx11-xcb1
    need_library libxcb.so.1 libxcb1
    need_library libXcursor.so.1 libxcursor1
    need_library libXi.so.6 libxi6
    need_library libXrandr.so.2 libxrandr2
    need_library libxkbcommon.so.0 libxkbcommon0
    need_library libxkbcommon-x11.so.0 libxkbcommon-x11-0
    need_library libwayland-client.so.0 libwayland-client0
}

# What the tests drive a window with, and the software adapter they draw with.
need_test_tools() {
    need_command Xvfb xvfb
    need_command xdotool xdotool
    has_vulkan_driver 'lvp_icd*.json' || missing_packages+=(mesa-vulkan-drivers)
}

install_missing() {
    [ "${#missing_packages[@]}" -eq 0 ] && return 0
    local packages
    mapfile -t packages < <(printf '%s\n' "${missing_packages[@]}" | sort -u)
    have apt-get || fail "these Debian packages or their like are missing; install them by your" \
        "system's package manager: ${packages[*]}"
    say "installing ${packages[*]}"
    as_root apt-get update -qq
    as_root env DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends \
        "${packages[@]}" >/dev/null
}

# Puts cargo on the path where rustup has put it without the shell's knowing.
find_cargo() {
    have cargo && return 0
    local bin="${CARGO_HOME:-$HOME/.cargo}/bin"
    [ -x "$bin/cargo" ] || return 1
    PATH="$bin:$PATH"
}

pinned_toolchain() { sed -n 's/^channel *= *"\(.*\)"/\1/p' rust-toolchain.toml; }

# Cargo of the pinned toolchain, or of a newer one where there is no rustup.
install_rust() {
    if ! find_cargo; then
        say "installing the Rust toolchain through rustup, into ${CARGO_HOME:-$HOME/.cargo}"
        curl --proto '=https' --tlsv1.2 -sSf https://sh.rustup.rs |
            sh -s -- -y -q --profile minimal --default-toolchain none --no-modify-path ||
            fail "rustup could not be fetched; install Rust by hand: https://rustup.rs"
        find_cargo || fail "rustup ran, and yet there is no cargo in ${CARGO_HOME:-$HOME/.cargo}/bin"
    fi
    if have rustup; then
        # Fetches what rust-toolchain.toml pins, unless it is there.
        rustup show active-toolchain >/dev/null 2>&1 && cargo --version >/dev/null 2>&1 && return 0
        say "installing the toolchain that rust-toolchain.toml pins"
        rustup toolchain install "$(pinned_toolchain)" --profile minimal \
            --component clippy --component rustfmt
        return 0
    fi
    local wanted found
    wanted=$(sed -n 's/^rust-version *= *"\(.*\)"/\1/p' Cargo.toml)
    found=$(cargo --version | cut -d' ' -f2)
    if [ "$(printf '%s\n' "$wanted" "$found" | sort -V | head -n 1)" != "$wanted" ]; then
        fail "expected cargo $wanted or newer, found $found; update it, or install rustup:" \
            "https://rustup.rs"
    fi
}

# set_up PART…: each part is a need_ function.
set_up() {
    local part
    if is_linux; then
        for part in "$@"; do "$part"; done
        install_missing
    fi
    install_rust
}

# build: makes the program of the folder $root. The first time it says how long that takes, and every half minute that it
# goes on: cargo is silent while it compiles the largest part.
build() {
    local begun=$SECONDS ticker built=0
    [ -x "${CARGO_TARGET_DIR:-$root/target}/release/voxsplat" ] ||
        say "building for the first time, which takes 7 to 11 minutes on two cores"
    (
        while sleep 30; do
            say "still building, for $(((SECONDS - begun) / 60)) min $(((SECONDS - begun) % 60)) s now"
        done
    ) &
    ticker=$!
    # An interrupted build must not leave it talking.
    trap 'kill "$ticker" 2>/dev/null' EXIT
    cargo build --release --locked --manifest-path "$root/Cargo.toml" || built=$?
    kill "$ticker" 2>/dev/null
    wait "$ticker" 2>/dev/null || true
    trap - EXIT
    return "$built"
}
