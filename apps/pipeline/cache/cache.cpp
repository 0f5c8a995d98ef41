#include "apps/pipeline/cache/cache.h"

#include <fcntl.h>
#include <fmt/core.h>
#include <signal.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstring>
#include <fstream>
#include <nlohmann/json.hpp>
#include <system_error>
#include <utility>

#include "apps/pipeline/values/digest.h"
#include "apps/pipeline/values/mesh_bytes.h"
#include "levelset/error.h"
#include "levelset/files/band_file.h"
#include "levelset/segmented/files/segmented_file.h"

namespace pipeline {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

constexpr int kCacheVersion = 2;
constexpr const char* kEntry = ".json";
constexpr const char* kGrid = ".vdb";
constexpr const char* kMesh = ".mesh";

Json notesJson(const StepNotes& notes) {
  Json json = {{"warnings", notes.warnings},
               {"notes", notes.notes},
               {"certificate", notes.certificateJson},
               {"details", notes.detailsJson}};
  json["lengths"] = Json::array();
  for (const Resolved& length : notes.lengths)
    json["lengths"].push_back({{"param", length.param},
                               {"written", length.written},
                               {"world", length.world},
                               {"voxels", length.voxels ? Json(*length.voxels) : Json()}});
  json["errors"] = Json::array();
  for (const ErrorEstimate& error : notes.errors)
    json["errors"].push_back(
        {{"measure", error.measure}, {"value", error.value}, {"unit", error.unit}});
  return json;
}

/// Reads a number. JSON cannot express infinity, so null stands for it.
double numberOf(const Json& json) {
  return json.is_number() ? json.get<double>() : HUGE_VAL;
}

StepNotes notesOf(const Json& json) {
  StepNotes notes;
  notes.warnings = json.at("warnings").get<std::vector<std::string>>();
  notes.notes = json.at("notes").get<std::vector<std::string>>();
  notes.certificateJson = json.at("certificate").get<std::string>();
  notes.detailsJson = json.at("details").get<std::string>();
  for (const Json& l : json.at("lengths")) {
    Resolved length{l.at("param").get<std::string>(), l.at("written").get<std::string>(),
                    numberOf(l.at("world"))};
    if (!l.at("voxels").is_null()) length.voxels = numberOf(l.at("voxels"));
    notes.lengths.push_back(std::move(length));
  }
  for (const Json& e : json.at("errors"))
    notes.errors.push_back({e.at("measure").get<std::string>(), numberOf(e.at("value")),
                            e.at("unit").get<std::string>()});
  return notes;
}

std::string contentsOf(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
}

/// Text of an entry file: a digest of the JSON text, then the JSON text. The digest detects damage
/// that leaves valid JSON.
std::string textOf(const Json& entry) {
  const std::string text = entry.dump(1, ' ', false, Json::error_handler_t::replace);
  return digestOf(text) + "\n" + text;
}

/// @throws std::exception if the entry is damaged or missing
Json readEntry(const fs::path& file) {
  const std::string bytes = contentsOf(file);
  const std::size_t end = std::min(bytes.find('\n'), bytes.size());
  const std::string text = bytes.substr(std::min(end + 1, bytes.size()));
  if (bytes.substr(0, end) != digestOf(text))
    throw levelset::InvalidInput(
        "cache: the entry file is damaged: its digest does not match its text");
  Json entry = Json::parse(text);
  if (entry.at("version") != kCacheVersion)
    throw levelset::InvalidInput("cache: the entry file has another version of the format");
  return entry;
}

std::int64_t nanoseconds(const timespec& time) {
  return time.tv_sec * 1'000'000'000 + time.tv_nsec;
}

void touch(const fs::path& file) {
  (void)::utimensat(AT_FDCWD, file.c_str(), nullptr, 0);
}

/// Hash of a value's content, to verify that it was read back unchanged.
std::uint64_t hashOf(const Value& value) {
  if (value.kind() == Kind::Band) return value.band().contentHash();
  if (value.kind() == Kind::Field) return value.field().contentHash();
  if (value.kind() == Kind::Segmentation) return value.segmentation().contentHash();
  return 0;  // mesh or point cloud: the stored bytes contain a digest
}

}  // namespace

std::optional<FileStamp> stampOf(const fs::path& file) {
  struct stat about;
  if (::stat(file.c_str(), &about) != 0 || !S_ISREG(about.st_mode)) return {};
  std::error_code error;
  const fs::path absolute = fs::absolute(file, error);
  return FileStamp{.path = (error ? file : absolute.lexically_normal()).string(),
                   .size = static_cast<std::uint64_t>(about.st_size),
                   .inode = about.st_ino,
                   .device = about.st_dev,
                   .changed = nanoseconds(about.st_mtim)};
}

Cache::Cache(fs::path folder) : folder_(std::move(folder)) {
  std::error_code error;
  for (const char* part : {"results", "files", "new"}) {
    fs::create_directories(folder_ / part, error);
    if (error)
      throw levelset::IoError(
          fmt::format("--cache: cannot create '{}': {}; use a folder that is writable",
                      (folder_ / part).string(), error.message()));
  }
  if (::access((folder_ / "new").c_str(), W_OK) != 0)
    throw levelset::IoError(
        fmt::format("--cache: '{}' is not writable; use another folder", folder_.string()));
}

bool Cache::canHold(Kind kind) {
  return kind == Kind::Band || kind == Kind::Field || kind == Kind::Mesh || kind == Kind::Points ||
         kind == Kind::Segmentation;
}

fs::path Cache::entryPath(const std::string& key, const char* extension) const {
  return folder_ / "results" / (key + extension);
}

fs::path Cache::temporary() const {
  static std::atomic<unsigned> count{0};
  return folder_ / "new" / fmt::format("{}-{}", ::getpid(), count++);
}

bool Cache::has(const std::string& key) const {
  std::error_code error;
  return fs::is_regular_file(entryPath(key, kEntry), error);
}

std::optional<CachedStep> Cache::step(const std::string& key) const {
  try {
    const Json json = readEntry(entryPath(key, kEntry));
    CachedStep step{.action = json.at("action").get<std::string>(),
                    .notes = notesOf(json.at("step")),
                    .output = json.at("output").get<std::string>(),
                    .files = {}};
    for (const Json& f : json.at("files"))
      step.files.push_back({f.at("path").get<std::string>(), f.at("size").get<std::uint64_t>(),
                            f.at("inode").get<std::uint64_t>(), f.at("device").get<std::uint64_t>(),
                            f.at("changed").get<std::int64_t>()});
    touch(entryPath(key, kEntry));
    return step;
  } catch (const std::exception&) {  // missing, damaged or of another version: no entry
    return {};
  }
}

std::optional<Value> Cache::value(const std::string& key, std::size_t maxMemory) const {
  try {
    const Json json = readEntry(entryPath(key, kEntry));
    const std::string kind = json.at("kind").get<std::string>();
    if (kind == kindName(Kind::Mesh)) {
      levelset::TriMesh mesh;
      if (!readMeshBytes(contentsOf(entryPath(key, kMesh)), mesh)) return {};
      return Value(std::move(mesh));
    }
    if (kind == kindName(Kind::Points)) {
      levelset::PointCloud cloud;
      if (!readCloudBytes(contentsOf(entryPath(key, kMesh)), cloud)) return {};
      return Value(std::move(cloud));
    }
    if (kind == kindName(Kind::Segmentation)) {
      const levelset::SegmentedField field =
          levelset::readSegmented(entryPath(key, kGrid), {.maxMemory = maxMemory});
      if (field.contentHash() != json.at("hash").get<std::uint64_t>()) return {};
      return Value(field);
    }
    const levelset::ReadBandOptions options{.grid = json.at("grid").get<std::string>(),
                                            .maxMemory = maxMemory};
    Value value = kind == kindName(Kind::Field)
                      ? Value(levelset::readField(entryPath(key, kGrid), options))
                      : Value(levelset::readBand(entryPath(key, kGrid), options));
    if (hashOf(value) != json.at("hash").get<std::uint64_t>()) return {};
    return value;
  } catch (const levelset::ResourceLimit&) {
    throw;
  } catch (const levelset::Cancelled&) {
    throw;
  } catch (const std::exception&) {  // missing, damaged or of another version: no entry
    return {};
  }
}

std::string Cache::put(const std::string& key, const CachedStep& step, const Value* value) const {
  const fs::path whole = temporary(), entry = temporary();
  try {
    Json json = {{"version", kCacheVersion},
                 {"action", step.action},
                 {"step", notesJson(step.notes)},
                 {"output", step.output},
                 {"files", Json::array()}};
    for (const FileStamp& file : step.files)
      json["files"].push_back({{"path", file.path},
                               {"size", file.size},
                               {"inode", file.inode},
                               {"device", file.device},
                               {"changed", file.changed}});
    if (value) {
      json["kind"] = kindName(value->kind());
      json["hash"] = hashOf(*value);
      const char* extension = kGrid;
      if (value->kind() == Kind::Mesh || value->kind() == Kind::Points) {
        extension = kMesh;
        std::ofstream out(whole, std::ios::binary);
        const std::string bytes =
            value->kind() == Kind::Mesh ? bytesOf(value->mesh()) : bytesOf(value->cloud());
        out.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
        if (!out.flush()) throw levelset::IoError("a write failed; check the free disk space");
      } else if (value->kind() == Kind::Segmentation) {
        levelset::writeSegmented(whole, value->segmentation());
      } else if (value->kind() == Kind::Field) {
        json["grid"] = value->field().name();
        levelset::writeField(whole, value->field(),
                             {.name = value->field().name(), .format = "vdb"});
      } else {
        json["grid"] = value->band().name();
        levelset::writeBand(whole, value->band(), {.name = value->band().name(), .format = "vdb"});
      }
      json["bytes"] = fs::file_size(whole);
      fs::rename(whole, entryPath(key, extension));
    }
    std::ofstream out(entry, std::ios::binary);
    out << textOf(json);
    out.close();
    if (!out) throw levelset::IoError("a write failed; check the free disk space");
    fs::rename(entry, entryPath(key, kEntry));
    return {};
  } catch (const levelset::Cancelled&) {
    std::error_code ignored;
    fs::remove(whole, ignored);
    throw;
  } catch (const std::exception& error) {
    std::error_code ignored;
    fs::remove(whole, ignored);
    fs::remove(entry, ignored);
    return fmt::format("--cache: the result of '{}' was not stored: {}", step.action, error.what());
  }
}

std::optional<std::string> Cache::memo(const std::string& name) const {
  const fs::path file = folder_ / "files" / name;
  std::error_code error;
  if (!fs::is_regular_file(file, error)) return {};
  std::string text = contentsOf(file);
  // Damaged: a complete file ends with a newline.
  if (text.size() < 2 || text.back() != '\n') return {};
  text.pop_back();
  return text;
}

void Cache::remember(const std::string& name, const std::string& text) const {
  const fs::path file = temporary();
  std::error_code ignored;
  std::ofstream out(file, std::ios::binary);
  out << text << '\n';
  out.close();
  if (out) fs::rename(file, folder_ / "files" / name, ignored);
  fs::remove(file, ignored);
}

std::vector<Cache::Entry> Cache::list() const {
  std::vector<Entry> entries;
  std::error_code error;
  for (const fs::directory_entry& item : fs::directory_iterator(folder_ / "results", error)) {
    if (item.path().extension() != kEntry) continue;
    Entry entry;
    entry.key = item.path().stem().string();
    struct stat about;
    if (::stat(item.path().c_str(), &about) != 0) continue;  // another process removed the entry
    entry.used = nanoseconds(about.st_mtim);
    entry.bytes = static_cast<std::uint64_t>(about.st_size);
    for (const char* extension : {kGrid, kMesh})
      if (::stat(entryPath(entry.key, extension).c_str(), &about) == 0)
        entry.bytes += static_cast<std::uint64_t>(about.st_size);
    const std::optional<CachedStep> known = [&]() -> std::optional<CachedStep> {
      try {
        return CachedStep{readEntry(item.path()).at("action").get<std::string>(), {}, {}, {}};
      } catch (const std::exception&) {
        return {};
      }
    }();
    entry.action = known ? known->action : "damaged";
    entries.push_back(std::move(entry));
  }
  std::sort(entries.begin(), entries.end(), [](const Entry& a, const Entry& b) {
    return a.used != b.used ? a.used > b.used : a.key < b.key;
  });
  return entries;
}

std::size_t Cache::shrink(std::uint64_t mostBytes) const {
  std::error_code ignored;
  std::uint64_t kept = 0;
  std::size_t gone = 0;
  for (const Entry& entry : list()) {
    if (entry.action != "damaged" && kept + entry.bytes <= mostBytes) {
      kept += entry.bytes;
      continue;
    }
    for (const char* extension : {kEntry, kGrid, kMesh})
      fs::remove(entryPath(entry.key, extension), ignored);
    ++gone;
  }
  // Remove value files without an entry file, and temporary files of dead processes. A live process
  // may be about to write the entry file of a value, so only value files older than one hour are
  // removed.
  constexpr auto kLongEnough = std::chrono::hours(1);
  const auto isOld = [&](const fs::path& file) {
    const auto written = fs::last_write_time(file, ignored);
    return !ignored && fs::file_time_type::clock::now() - written > kLongEnough;
  };
  for (const fs::directory_entry& item : fs::directory_iterator(folder_ / "results", ignored))
    if (item.path().extension() != kEntry && !has(item.path().stem().string()) &&
        isOld(item.path()))
      fs::remove(item.path(), ignored);
  for (const fs::directory_entry& item : fs::directory_iterator(folder_ / "new", ignored)) {
    const int process = std::atoi(item.path().filename().c_str());
    if (process > 0 && ::kill(process, 0) != 0 && errno == ESRCH) fs::remove(item.path(), ignored);
  }
  return gone;
}

}  // namespace pipeline
