#include "apps/pipeline/values/mesh_bytes.h"

#include <cstdint>
#include <cstring>
#include <string_view>
#include <type_traits>
#include <vector>

#include "apps/pipeline/values/digest.h"

namespace pipeline {
namespace {

template <typename T>
void addBytes(std::string& to, const T& value) {
  static_assert(std::is_trivially_copyable_v<T>);
  to.append(reinterpret_cast<const char*>(&value), sizeof value);
}

template <typename T>
void addList(std::string& to, const std::vector<T>& list) {
  addBytes(to, static_cast<std::uint64_t>(list.size()));
  if (!list.empty()) to.append(reinterpret_cast<const char*>(list.data()), list.size() * sizeof(T));
}

struct ByteReader {
  const char* at;
  std::size_t left;
  bool isWhole = true;

  template <typename T>
  void read(T& value) {
    copy(&value, sizeof value);
  }
  template <typename T>
  void readList(std::vector<T>& list) {
    std::uint64_t count = 0;
    read(count);
    if (!isWhole || count > left / sizeof(T)) {
      isWhole = false;
      return;
    }
    list.resize(count);
    copy(list.data(), count * sizeof(T));
  }

 private:
  void copy(void* to, std::size_t size) {
    isWhole = isWhole && size <= left;
    if (!isWhole || size == 0) return;
    std::memcpy(to, at, size);
    at += size;
    left -= size;
  }
};

constexpr std::size_t kDigestSize = 32;

/// Returns true when the bytes begin with the digest of the others.
bool hasDigest(const std::string& bytes) {
  if (bytes.size() < kDigestSize) return false;
  const std::string_view all = bytes;
  return all.substr(0, kDigestSize) == digestOf(all.substr(kDigestSize));
}

}  // namespace

std::string bytesOf(const levelset::TriMesh& mesh) {
  std::string bytes;
  addList(bytes, mesh.positions);
  addList(bytes, mesh.triangles);
  addBytes(bytes, mesh.precision);
  addBytes(bytes, mesh.spacing);
  const levelset::MeshAttributes& more = mesh.attributes;
  addList(bytes, more.normals);
  addList(bytes, more.uvs);
  addList(bytes, more.colors);
  addBytes(bytes, more.precision);
  addBytes(bytes, more.colorPrecision);
  addBytes(bytes, more.hasAlpha);
  return digestOf(bytes) + bytes;
}

bool readMeshBytes(const std::string& bytes, levelset::TriMesh& mesh) {
  if (!hasDigest(bytes)) return false;
  ByteReader reader{bytes.data() + kDigestSize, bytes.size() - kDigestSize};
  reader.readList(mesh.positions);
  reader.readList(mesh.triangles);
  reader.read(mesh.precision);
  reader.read(mesh.spacing);
  levelset::MeshAttributes& more = mesh.attributes;
  reader.readList(more.normals);
  reader.readList(more.uvs);
  reader.readList(more.colors);
  reader.read(more.precision);
  reader.read(more.colorPrecision);
  reader.read(more.hasAlpha);
  return reader.isWhole && reader.left == 0;
}

std::string bytesOf(const levelset::PointCloud& cloud) {
  std::string bytes;
  addList(bytes, cloud.positions);
  addList(bytes, cloud.normals);
  addList(bytes, cloud.colors);
  addList(bytes, cloud.radii);
  addList(bytes, cloud.weights);
  addBytes(bytes, cloud.precision);
  return digestOf(bytes) + bytes;
}

bool readCloudBytes(const std::string& bytes, levelset::PointCloud& cloud) {
  if (!hasDigest(bytes)) return false;
  ByteReader reader{bytes.data() + kDigestSize, bytes.size() - kDigestSize};
  reader.readList(cloud.positions);
  reader.readList(cloud.normals);
  reader.readList(cloud.colors);
  reader.readList(cloud.radii);
  reader.readList(cloud.weights);
  reader.read(cloud.precision);
  return reader.isWhole && reader.left == 0;
}

}  // namespace pipeline
