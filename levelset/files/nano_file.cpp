#include "levelset/files/nano_file_vdb.h"

#include <nanovdb/util/IO.h>
#include <nanovdb/util/OpenToNanoVDB.h>

#include <fstream>

namespace levelset {

void writeNanoGrid(const std::filesystem::path& path, const openvdb::FloatGrid& grid) {
  const auto handle = nanovdb::openToNanoVDB(grid);
  std::ofstream out;
  out.exceptions(std::ios::badbit | std::ios::failbit);
  out.open(path, std::ios::binary);
  nanovdb::io::writeGrid(out, handle, nanovdb::io::Codec::NONE);
  out.close();
}

}  // namespace levelset
