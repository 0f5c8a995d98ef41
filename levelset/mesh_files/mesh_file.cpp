#include "levelset/mesh_files/mesh_file.h"

#include <fmt/core.h>

#include <new>
#include <optional>

#include "levelset/error.h"
#include "levelset/mesh_files/mesh_parts.h"

namespace levelset {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kInfoBytes = 1 << 20;

struct MeshFormat {
  const char* extension;
  void (*read)(std::string_view, MeshBuilder&);
  void (*write)(ByteWriter&, const TriMesh&, const Progress&);
  bool attributes;
};

constexpr MeshFormat kFormats[] = {{"ply", readPly, writePly, true},
                                   {"obj", readObj, writeObj, true},
                                   {"stl", readStl, writeStl, false},
                                   {"off", readOff, writeOff, false}};

struct FormatChoice {
  const MeshFormat* format;
  bool compressed;
};

std::optional<FormatChoice> findFormat(const fs::path& nameOrFormat) {
  std::string text = nameOrFormat.filename().string();
  for (char& c : text)
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c | 0x20);
  const bool compressed = text.ends_with(".gz");
  if (compressed) text.resize(text.size() - 3);
  const std::string extension = text.substr(text.rfind('.') + 1);  // the complete text if there is
                                                                   // no dot
  for (const MeshFormat& format : kFormats)
    if (extension == format.extension) return FormatChoice{&format, compressed};
  return std::nullopt;
}

/// @param isInput  true for a file to be read
FormatChoice meshFormat(const fs::path& path, const std::string& given, bool isInput) {
  if (!given.empty()) {
    if (const auto choice = findFormat(given)) return *choice;
    throw UsageError(
        fmt::format("the mesh format '{}' is unknown; use ply, obj, stl or off, "
                    "with .gz appended if compressed",
                    given));
  }
  if (const auto choice = findFormat(path)) return *choice;
  if (path == "-") {
    throw UsageError(
        fmt::format("standard {} has no name that determines its format; give --format ply, "
                    "obj, stl or off",
                    isInput ? "input" : "output"));
  }
  throw UsageError(
      fmt::format("the name '{}' names no mesh format; end it in .ply, .obj, .stl or "
                  ".off, or give --format",
                  path.string()));
}

}  // namespace

TriMesh readMesh(const fs::path& path, const ReadMeshOptions& options) {
  const FormatChoice choice = meshFormat(path, options.format, true);
  report(options.progress, 0);
  try {
    const Bytes bytes = readBytes(path, options.maxMemory);
    MeshBuilder builder(inputName(path), options, bytes.view());
    choice.format->read(bytes.view(), builder);
    TriMesh mesh = builder.finish();
    if (builder.droppedAttributes())
      if (auto closed = withoutSeams(mesh, options.maxMemory)) mesh = std::move(*closed);
    if (mesh.isEmpty())
      failFile(
          inputName(path),
          "holds only triangles without area, of which none remains when its seams are closed; "
          "export the mesh again");
    report(options.progress, 1);
    return mesh;
  } catch (const std::bad_alloc&) {
    throw ResourceLimit(fmt::format(
        "{} does not fit into memory; use a smaller mesh or free memory", inputName(path)));
  }
}

void writeMesh(const fs::path& path, const TriMesh& mesh, const WriteMeshOptions& options) {
  const FormatChoice choice = meshFormat(path, options.format, false);
  requireAttributes(mesh);
  report(options.progress, 0);
  // A format without attributes needs no seams: their doubled vertices would be open slits in the
  // surface, so they are merged.
  std::optional<TriMesh> closed;
  if (!choice.format->attributes && !mesh.attributes.isEmpty())
    closed = withoutSeams(mesh, options.maxMemory);
  ByteWriter out(path, choice.compressed);
  choice.format->write(out, closed ? *closed : mesh, options.progress);
  out.commit();
  report(options.progress, 1);
}

bool holdsAttributes(const fs::path& nameOrFormat) {
  const auto choice = findFormat(nameOrFormat);
  return choice && choice->format->attributes;
}

bool isMeshFormat(const fs::path& nameOrFormat) {
  return findFormat(nameOrFormat).has_value();
}

MeshFileInfo meshFileInfo(const fs::path& path, const std::string& format) {
  const FormatChoice choice = meshFormat(path, format, true);
  const std::string name = inputName(path);
  const FirstBytes first = readFirstBytes(path, kInfoBytes);
  const std::string_view head = first.bytes.view();
  if (head.empty()) failFile(name, "is empty; download or create the file again");
  MeshFileInfo info;
  if (choice.format->read == readPly) {
    info = plyInfo(head, first.fileSize, name);
    const bool isMesh = info.vertices > 0 && info.faces > 0, isKnown = first.fileSize > 0;
    if (isMesh && isKnown && path != "-" && !plyHoldsTriangles(head, first.fileSize, name))
      (void)readMesh(path, {.format = format});  // throws with the position at which the data ends
  } else if (choice.format->read == readStl) {
    info = stlInfo(head, first.fileSize, name);
  } else if (choice.format->read == readOff) {
    info = offInfo(head, first.fileSize, name);
  } else {
    info.format = choice.format->extension;
  }
  if (choice.compressed) info.format += ", compressed";
  return info;
}

}  // namespace levelset
