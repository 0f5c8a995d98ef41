# star NAME HEIGHT: writes a prism over a five-pointed star to NAME.ply
star() {
  awk -v h="$2" 'BEGIN {
    pi = atan2(0, -1)
    print "ply\nformat ascii 1.0\nelement vertex 22\nproperty float x\nproperty float y\nproperty float z"
    print "element face 40\nproperty list uchar int vertex_indices\nend_header"
    for (k = 0; k < 2; ++k) {
      for (i = 0; i < 10; ++i) { r = i % 2 ? 0.45 : 1; print r * sin(pi * i / 5), r * cos(pi * i / 5), k * h }
      print 0, 0, k * h
    }
    for (i = 0; i < 10; ++i) {
      j = (i + 1) % 10
      print 3, 10, i, j
      print 3, 21, 11 + j, 11 + i
      print 3, i, 11 + i, 11 + j
      print 3, i, 11 + j, j
    }
  }' > "$1.ply"
}

# starfish: writes five rods, blended, to starfish.vdb
starfish() {
  arm() { awk -v i="$1" 'BEGIN { a = atan2(0, -1) * 2 * i / 5; printf "%.6f,%.6f,0", sin(a), cos(a) }'; }
  make starfish capsule --from 0,0,0 --to "$(arm 0)" --radius 0.24 --voxel 0.03 \
    ! capsule --from 0,0,0 --to "$(arm 1)" --radius 0.24 --voxel 0.03 ! union \
    ! capsule --from 0,0,0 --to "$(arm 2)" --radius 0.24 --voxel 0.03 ! union \
    ! capsule --from 0,0,0 --to "$(arm 3)" --radius 0.24 --voxel 0.03 ! union \
    ! capsule --from 0,0,0 --to "$(arm 4)" --radius 0.24 --voxel 0.03 ! blend --radius 0.2
}
