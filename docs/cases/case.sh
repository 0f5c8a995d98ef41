# The cases source this file with "$@": CASE.sh COMMAND FOLDER. It writes solids, reports and pictures to FOLDER,
# the sheet of pictures to docs/cases, and the table to standard output. If the case succeeds, the table also replaces
# the one below the case's picture in docs/cases/README.md.
set -eu
levelsmith=$1
out=$2
here=$(dirname "$0")
models=$here/../../data/models
mkdir -p "$out"
[ -f "$models/bunny.obj" ] && [ -f "$models/dragon_vrip.ply.gz" ] && [ -f "$models/TeapotBufferGeometry.js" ] || {
  echo "The models are not in data/models: fetch them with ./dev fetch." >&2
  exit 1
}

case_name=$(basename "$0" .sh)
exec 3>&1 >"$out/$case_name.md"
finish() {
  status=$?
  cat "$out/$case_name.md" >&3
  [ $status -ne 0 ] || "${PYTHON:-python3}" "$here/figures.py" insert "$here/README.md" "$case_name" "$out/$case_name.md"
  exit $status
}
trap finish EXIT

make() {  # make NAME CHAIN...: writes NAME.vdb unless it exists
  name=$1
  shift
  [ -f "$out/$name.vdb" ] || "$levelsmith" --quiet "$@" ! write "$out/$name.vdb"
}

map() {  # map NAME CHAIN...: writes NAME.vdb and its report
  name=$1
  shift
  "$levelsmith" --quiet --report "$out/$name.json" "$@" ! write "$out/$name.vdb"
}

animate() {  # animate NAME CHAIN...: a chain that ends with the action animate, which writes the frames; writes its report
  name=$1
  shift
  "$levelsmith" --quiet --report "$out/$name.json" "$@"
}

picture() {  # picture NAME OPTIONS...: draws NAME.vdb
  name=$1
  shift
  "$levelsmith" --quiet read "$out/$name.vdb" ! render "$out/$name.png" --size 480x360 "$@"
}

scene() {  # scene PICTURE BASE NAME OPTIONS...: draws BASE.vdb and NAME.vdb together
  drawn=$1
  base=$2
  name=$3
  shift 3
  "$levelsmith" --quiet read "$out/$base.vdb" --as base ! read "$out/$name.vdb" --as mapped \
    ! scene @base @mapped --csg "base | mapped" ! render "$out/$drawn.png" --size 480x360 "$@"
}

difference() {  # difference REFERENCE NAME: writes the distances of the surfaces of two solids to NAME-error.json
  "$levelsmith" --quiet --report "$out/$2-error.json" read "$out/$1.vdb" ! read "$out/$2.vdb" ! compare > /dev/null
}

solid() {  # solid NAME: writes components, cavities and Euler characteristic of NAME.vdb to NAME-solid.json
  "$levelsmith" --quiet --report "$out/$1-solid.json" read "$out/$1.vdb" ! measure > /dev/null
}

sheet() {  # sheet NAME COLUMNS PICTURE=TITLE...
  "${PYTHON:-python3}" "$here/figures.py" sheet "$out" "$here/$@"
}

row() {  # row NAME FIELD... "'text'": prints a row of the table from the last texture in NAME's report
  "${PYTHON:-python3}" "$here/figures.py" row "$out" "$@"
}

frames() {  # frames NAME: prints a row of the table for each frame of the animation in NAME's report
  "${PYTHON:-python3}" "$here/figures.py" frames "$out" "$1"
}

figure() {  # figure NAME FIELD: prints that figure alone
  row "$1" "$2" | tr -d '| '
}

in_voxels() {  # in_voxels NAME FIELD VOXEL: prints a length in voxels
  awk -v a="$(figure "$1" "$2")" -v h="$3" 'BEGIN { printf "%.2g", a / h }'
}

# expect NAME FIELD OPERATOR VALUE: exits 5 with a message unless the comparison (<, <=, =, >=, >) holds for each
# texture in NAME's report
expect() {
  "${PYTHON:-python3}" "$here/figures.py" expect "$out" "$@"
}

bunny() {  # bunny VOXELS: in the orientation of the scan
  make "bunny$1" read "$models/bunny.obj" ! level-set --resolution "$1"
}

standing_bunny() {  # standing_bunny VOXELS: z is up, as required for textures
  make "standing$1" read "$models/bunny.obj" ! transform --rotate 90,0,0 ! level-set --resolution "$1"
}

standing_dragon() {  # standing_dragon VOXELS
  make "dragon$1" read "$models/dragon_vrip.ply.gz" ! transform --rotate 90,0,0 ! level-set --resolution "$1"
}

# teapot NAME TURN SCALE PLACE VOXEL: a solid of the Utah teapot's patches, turned by the three angles TURN with z up
teapot() {
  "${PYTHON:-python3}" "$here/teapot.py" "$models/TeapotBufferGeometry.js" "$out"
  chain=
  for part in pot handle spout; do
    chain="$chain read $out/teapot-$part.ply ! transform --rotate $2 --scale $3 --translate $4 ! level-set --voxel $5 !"
    [ $part = pot ] || chain="$chain union !"
  done
  make "$1" ${chain% !}
}
