#!/bin/sh
# Renders the pictures of the README into scenes/pictures/. Scenes that are not here are left out: the dragon comes by
# scenes/fetch.sh; COURSE names a folder with the course's CBspheres_lambertian.dae and CBbunny.dae, LUCY a
# lucy100k.obj, if there are any.
set -eu

root=$(cd "$(dirname "$0")/../.." && pwd)
out=$root/scenes/pictures
cargo build --release --manifest-path "$root/Cargo.toml"
comber=$root/target/release/comber

# shot NAME ARGUMENTS...: one picture.
shot() {
    name=$1
    shift
    echo "$name.png"
    "$comber" render "$@" --quiet -o "$out/$name.png"
}

# modes NAME SCENE: what each integrator shows of a scene.
modes() {
    for mode in path direct zero-bounce one-bounce indirect-only normals; do
        shot "$1-$mode" "$2" -r 240 180 -s 400 --integrator "$mode"
    done
    shot "$1-bvh-cost" "$2" -r 240 180 -s 16 --integrator bvh-cost
    echo "$1-tree.png"
    "$comber" bvh "$2" -r 240 180 --depth "$3" --quiet -o "$out/$1-tree.png"
}

shot default -s 400
modes spheres "$root/scenes/cornell_spheres.dae" 1
shot studio proc:coral,tris=2M --stage studio -s 256
if [ -f "$root/scenes/models/dragon_vrip.ply" ]; then
    shot dragon "$root/scenes/models/dragon_vrip.ply" -s 400
fi
if [ -f "${LUCY:-}" ]; then
    shot lucy100k "$LUCY" -s 400
    large=$(mktemp -d)
    "$comber" mesh "$LUCY" --split 17 --noise 0.1 -o "$large/lucy28m.ply" --quiet
    shot lucy28m "$large/lucy28m.ply" -r 1920 1080 -s 16 --cache off
    rm -r "$large"
fi
if [ -d "${COURSE:-}" ]; then
    modes CBspheres_lambertian "$COURSE/CBspheres_lambertian.dae" 1
    modes CBbunny "$COURSE/CBbunny.dae" 4
    # Writes CBbunny-adaptive_rate.png beside it.
    shot CBbunny-adaptive "$COURSE/CBbunny.dae" -s 2048 -a 64 0.05
    # What pixels share.
    shot CBbunny-16 "$COURSE/CBbunny.dae" -r 240 180 -s 16
    shot CBbunny-16-shared "$COURSE/CBbunny.dae" -r 240 180 -s 16 --reuse 16 --lamp-rays 16
fi
