#!/bin/sh
# A baby dragon on its mother's nose: time of direct sums, fast sums and tetrahedra at equal error
# [Brodersen07 fig. 9.4, table 9.2]. All maps go through particles of one fine patch: every 2nd, 4th, 8th or 16th row and
# column. The reference is the map by tetrahedra through all of them.
. "$(dirname "$0")/case.sh"
standing_dragon 512
standing_dragon 240
voxel=0.00005
[ -f "$out/nose.patch" ] || "$levelsmith" --quiet read "$out/dragon512.vdb" --as mother \
  ! patch-grid @mother --at -0.0835,0.001,0.182 --size 0.0111,0.0056 --rotate 30 --count 1,1 --particles reduced \
  --height 0.00906 --layers 29 --spacing 0.000077 ! write "$out/nose.patch"
thin() { "${PYTHON:-python3}" "$here/figures.py" thin "$out/nose.patch" "$out/nose-$1.patch" "$1" "$2"; }
thin 16 7
thin 8 4
thin 4 2
thin 2 1
lay() {  # lay NAME PATCH OPTIONS...
  name=$1
  patch=$2
  shift 2
  map "nose-$name" read "$out/dragon512.vdb" --as mother ! read "$out/dragon240.vdb" --as baby ! read "$out/$patch.patch" --as nose \
    ! texture @mother @baby @nose --alone --voxel "$voxel" --embed 1vx "$@"
}
lay all nose --map shell
echo "| map | every | particles | setup s | mapping s | points | tests a point | mean error, voxels | largest | least Jacobian |"
echo "|---|--:|--:|--:|--:|--:|--:|--:|--:|--:|"
run() {  # run NAME "TITLE" EVERY OPTIONS...: a map through every EVERY-th row, and its error
  run=$1-$3
  title=$2
  every=$3
  shift 3
  lay "$run" "nose-$every" "$@"
  difference nose-all "nose-$run"
  mean=$(in_voxels "nose-$run-error" mean_b_to_a "$voxel")
  largest=$(in_voxels "nose-$run-error" hausdorff "$voxel")
  row "nose-$run" "'$title'" "'$every'" particles cpu_s.setup cpu_s.mapping points operations_per_point "'$mean'" "'$largest'" min_jacobian
}
for every in 16 8 4; do run direct "direct sum" $every --lambda-near 0 --lambda-far 0 --map-tolerance 0; done
for every in 16 8 4; do run fast "fast sum" $every --lambda-near 0 --lambda-far 0; done
for every in 16 8 4 2; do run shell tetrahedra $every --map shell; done
direct=nose-direct-16,nose-direct-8,nose-direct-4
fast=nose-fast-16,nose-fast-8,nose-fast-4
shell=nose-shell-16,nose-shell-8,nose-shell-4,nose-shell-2
echo
echo "| equal error, voxels | particles of the sums | of tetrahedra | direct sum s | fast sum s | tetrahedra s | direct / tetrahedra | fast / tetrahedra |"
echo "|--:|--:|--:|--:|--:|--:|--:|--:|"
"${PYTHON:-python3}" "$here/figures.py" equal "$out" "$voxel" $direct $fast $shell
echo "| thesis: to the eye | 248 | 3822 | 406.156 | – | 55.609 | 7.30 | – |"
for every in 16 8 4; do expect "nose-fast-$every" map_error "<=" 0.05; done
expect nose-fast-16-error mean_a_to_b "<" 0.00004
expect nose-fast-4-error mean_a_to_b "<" 0.000005
expect nose-shell-8-error mean_a_to_b "<" 0.00004
expect nose-shell-2-error mean_a_to_b "<" 0.000002
expect nose-shell-2-error hausdorff "<" 0.00004  # no piece is missing
for every in 16 8 4; do
  expect "nose-fast-$every" min_jacobian ">" 0.3
  expect "nose-shell-$every" min_jacobian ">" 0.3
done
scene nose-mother dragon512 nose-fast-16 --from -0.23,-0.2,0.24 --to -0.062,0,0.168 --up 0,0,1 --fov 22
for run in fast-16 shell-16 shell-8 shell-2; do
  scene "nose-$run" dragon512 "nose-$run" --from -0.122,-0.022,0.2 --to -0.0838,0.0005,0.1848 --up 0,0,1 --fov 18
done
"${PYTHON:-python3}" "$here/figures.py" timing "$out" nose-times "$voxel" "direct sum=$direct" "fast sum=$fast" "tetrahedra=$shell"
particles() { figure "nose-$1" particles; }
sheet dragon-on-nose 3 "nose-mother=fast sum, $(particles fast-16) particles" "nose-fast-16=the same" \
  "nose-times=error against time, with numbers of particles" "nose-shell-16=tetrahedra, $(particles shell-16) particles" \
  "nose-shell-8=tetrahedra, $(particles shell-8) particles, error as above" "nose-shell-2=tetrahedra, $(particles shell-2) particles"
