# The cases source this file with "$@": CASE.sh COMMAND FOLDER. It writes solids, reports and pictures to FOLDER,
# the sheet of pictures to docs/cases, and the table to standard output.
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

solid() {  # solid NAME: writes components, cavities and Euler characteristic of NAME.vdb to NAME-solid.json
  "$levelsmith" --quiet --report "$out/$1-solid.json" read "$out/$1.vdb" ! measure > /dev/null
}

sheet() {  # sheet NAME COLUMNS PICTURE=TITLE...
  "${PYTHON:-python3}" "$here/figures.py" sheet "$out" "$here/$@"
}

row() {  # row NAME FIELD... "'text'": prints a row of the table from the last texture in NAME's report
  "${PYTHON:-python3}" "$here/figures.py" row "$out" "$@"
}

frames() {  # frames NAME "text"...: prints a row of the table for each frame of the animation in NAME's report
  "${PYTHON:-python3}" "$here/figures.py" frames "$out" "$@"
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
