#include "render/gpu/device/gl_context.h"

#define EGL_NO_X11
#include <EGL/egl.h>
#include <EGL/eglext.h>
#include <dlfcn.h>
#include <fmt/core.h>

#include <array>
#include <exception>
#include <string_view>
#include <vector>

#include "levelset/error.h"

namespace render {
namespace {

constexpr const char* kRemedy = "use a machine with OpenGL 4.5, or draw with --renderer cpu";

bool hasWord(const char* words, std::string_view word) {
  return words && std::string_view(words).find(word) != std::string_view::npos;
}

}  // namespace

struct GlContext::Egl {
  void* library = nullptr;
  decltype(&eglGetProcAddress) getProcAddress = nullptr;
  decltype(&eglQueryString) queryString = nullptr;
  decltype(&eglInitialize) initialize = nullptr;
  decltype(&eglBindAPI) bindApi = nullptr;
  decltype(&eglCreateContext) createContext = nullptr;
  decltype(&eglDestroyContext) destroyContext = nullptr;
  decltype(&eglMakeCurrent) makeCurrent = nullptr;
  decltype(&eglReleaseThread) releaseThread = nullptr;
  PFNEGLGETPLATFORMDISPLAYEXTPROC getPlatformDisplay = nullptr;
  EGLDisplay display = EGL_NO_DISPLAY;
  EGLContext context = EGL_NO_CONTEXT;
  std::string tried;  // failed attempts to open a context, with reasons, for the error message

  Egl() {
    library = dlopen("libEGL.so.1", RTLD_NOW | RTLD_LOCAL);
    if (!library) {
      throw NoOpenGl(fmt::format("EGL is not available ({}); {}", dlerror(), kRemedy));
    }
    const auto load = [&](auto& function, const char* name) {
      function =
          reinterpret_cast<std::remove_reference_t<decltype(function)>>(dlsym(library, name));
      if (!function) throw NoOpenGl(fmt::format("EGL has no function {}; {}", name, kRemedy));
    };
    load(getProcAddress, "eglGetProcAddress");
    load(queryString, "eglQueryString");
    load(initialize, "eglInitialize");
    load(bindApi, "eglBindAPI");
    load(createContext, "eglCreateContext");
    load(destroyContext, "eglDestroyContext");
    load(makeCurrent, "eglMakeCurrent");
    load(releaseThread, "eglReleaseThread");
    getPlatformDisplay = reinterpret_cast<PFNEGLGETPLATFORMDISPLAYEXTPROC>(
        getProcAddress("eglGetPlatformDisplayEXT"));
    if (!getPlatformDisplay)
      throw NoOpenGl(fmt::format("EGL does not support contexts without a window; {}", kRemedy));
  }
  // The library is not unloaded: drivers leave threads and handlers that outlive the context.
  ~Egl() { close(); }
  Egl(const Egl&) = delete;
  Egl& operator=(const Egl&) = delete;

  /// Destroys the context. It does not terminate the display, because the entire process shares it.
  void close() {
    if (context != EGL_NO_CONTEXT) destroyContext(display, context);
    display = EGL_NO_DISPLAY;
    context = EGL_NO_CONTEXT;
  }

  /// Opens a context: tries hardware devices first, then the surfaceless platform, then software
  /// devices.
  void open() {
    std::vector<EGLDeviceEXT> hardware, software;
    listDevices(hardware, software);
    for (EGLDeviceEXT device : hardware)
      if (openOn(EGL_PLATFORM_DEVICE_EXT, device, "hardware device")) return;
    if (openOn(EGL_PLATFORM_SURFACELESS_MESA, EGL_DEFAULT_DISPLAY, "surfaceless platform")) return;
    for (EGLDeviceEXT device : software)
      if (openOn(EGL_PLATFORM_DEVICE_EXT, device, "software device")) return;
    throw NoOpenGl(fmt::format("OpenGL 4.5 is not available ({}); {}", tried, kRemedy));
  }

  void listDevices(std::vector<EGLDeviceEXT>& hardware, std::vector<EGLDeviceEXT>& software) {
    const auto queryDevices =
        reinterpret_cast<PFNEGLQUERYDEVICESEXTPROC>(getProcAddress("eglQueryDevicesEXT"));
    const auto queryDevice =
        reinterpret_cast<PFNEGLQUERYDEVICESTRINGEXTPROC>(getProcAddress("eglQueryDeviceStringEXT"));
    if (!queryDevices || !queryDevice) return;
    std::array<EGLDeviceEXT, 32> devices;
    EGLint count = 0;
    if (!queryDevices(static_cast<EGLint>(devices.size()), devices.data(), &count)) return;
    for (std::size_t i = 0; i < static_cast<std::size_t>(count); ++i) {
      const bool isSoftware =
          hasWord(queryDevice(devices[i], EGL_EXTENSIONS), "EGL_MESA_device_software");
      (isSoftware ? software : hardware).push_back(devices[i]);
    }
  }

  bool openOn(EGLenum platform, void* native, const char* name) {
    const auto fail = [&](const char* what) {
      tried += fmt::format("{}{}: {}", tried.empty() ? "" : ", ", name, what);
      close();
      return false;
    };
    display = getPlatformDisplay(platform, native, nullptr);
    if (display == EGL_NO_DISPLAY) return fail("EGL offers no display");
    if (!initialize(display, nullptr, nullptr)) {
      display = EGL_NO_DISPLAY;
      return fail("EGL cannot initialise the display");
    }
    if (!hasWord(queryString(display, EGL_EXTENSIONS), "EGL_KHR_surfaceless_context"))
      return fail("EGL_KHR_surfaceless_context is missing");
    if (!bindApi(EGL_OPENGL_API)) return fail("EGL offers no OpenGL");
    // Request notification of a lost context, if the driver supports it.
    for (const bool tellsLoss : {true, false}) {
      const EGLint version[] = {
          EGL_CONTEXT_MAJOR_VERSION,
          4,
          EGL_CONTEXT_MINOR_VERSION,
          5,
          EGL_CONTEXT_OPENGL_PROFILE_MASK,
          EGL_CONTEXT_OPENGL_CORE_PROFILE_BIT,
          tellsLoss ? EGL_CONTEXT_OPENGL_RESET_NOTIFICATION_STRATEGY : EGL_NONE,
          EGL_LOSE_CONTEXT_ON_RESET,
          EGL_NONE};
      context = createContext(display, EGL_NO_CONFIG_KHR, EGL_NO_CONTEXT, version);
      if (context != EGL_NO_CONTEXT) return true;
    }
    return fail("EGL cannot create an OpenGL 4.5 context");
  }
};

/// A job that waits for the context's thread, and its result.
struct GlContext::Waiting {
  const std::function<void()>& job;
  std::exception_ptr failure;
  bool isDone = false;
};

GlContext::GlContext() : egl_(std::make_unique<Egl>()), thread_([this] { work(); }) {
  try {
    run([this] { open(); });
  } catch (...) {
    end();
    throw;
  }
}

GlContext::~GlContext() {
  end();
}

void GlContext::end() {
  {
    const std::scoped_lock lock(mutex_);
    isEnding_ = true;
  }
  hasWork_.notify_all();
  thread_.join();
}

void GlContext::open() {
  egl_->open();
  if (!egl_->makeCurrent(egl_->display, EGL_NO_SURFACE, EGL_NO_SURFACE, egl_->context))
    throw NoOpenGl(fmt::format("the OpenGL context cannot be made current; {}", kRemedy));
  const auto load = [&](auto& function, const char* name) {
    function =
        reinterpret_cast<std::remove_reference_t<decltype(function)>>(egl_->getProcAddress(name));
    if (!function) throw NoOpenGl(fmt::format("OpenGL has no function {}; {}", name, kRemedy));
  };
#define LEVELSMITH_GL_LOAD(Type, name) load(gl_.name, "gl" #name);
  LEVELSMITH_GL_FUNCTIONS(LEVELSMITH_GL_LOAD)
#undef LEVELSMITH_GL_LOAD
  const auto text = [&](GLenum name) {
    const GLubyte* string = gl_.GetString(name);
    return string ? std::string(reinterpret_cast<const char*>(string)) : std::string("unknown");
  };
  description_ = text(GL_RENDERER) + ", OpenGL " + text(GL_VERSION);
  GLint64 texels = 0, units = 0;
  gl_.GetInteger64v(GL_MAX_TEXTURE_BUFFER_SIZE, &texels);
  gl_.GetInteger64v(GL_MAX_COMPUTE_TEXTURE_IMAGE_UNITS, &units);
  largestTable_ = static_cast<std::size_t>(texels) * 4;
  tableCount_ = static_cast<int>(units);
}

void GlContext::work() {
  std::unique_lock lock(mutex_);
  for (;;) {
    hasWork_.wait(lock, [this] { return isEnding_ || !waiting_.empty(); });
    if (waiting_.empty()) break;
    Waiting& next = *waiting_.front();
    waiting_.pop_front();
    lock.unlock();
    try {
      next.job();
    } catch (...) {
      next.failure = std::current_exception();
    }
    lock.lock();
    next.isDone = true;
    hasAnswer_.notify_all();
  }
  lock.unlock();
  if (egl_->context != EGL_NO_CONTEXT)
    egl_->makeCurrent(egl_->display, EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT);
  egl_->close();
  // Release EGL's state of the thread here: Mesa frees it when the thread ends, and again when the
  // process ends, and crashes if both happen at once.
  egl_->releaseThread();
}

void GlContext::run(const std::function<void()>& job) const {
  if (std::this_thread::get_id() == thread_.get_id()) return job();
  Waiting mine{job, nullptr};
  std::unique_lock lock(mutex_);
  waiting_.push_back(&mine);
  hasWork_.notify_one();
  hasAnswer_.wait(lock, [&] { return mine.isDone; });
  if (mine.failure) std::rethrow_exception(mine.failure);
}

void GlContext::check(const char* what) const {
  if (gl_.GetGraphicsResetStatus() != GL_NO_ERROR) {
    throw levelset::ResourceLimit(
        fmt::format("the OpenGL context was lost while {}; draw a smaller "
                    "picture, or with --renderer cpu",
                    what));
  }
  const GLenum error = gl_.GetError();
  if (error == GL_NO_ERROR) return;
  throw levelset::ResourceLimit(
      fmt::format("{} failed with OpenGL error {:#x}{}; use larger voxels, or draw with --renderer "
                  "cpu",
                  what, error, error == GL_OUT_OF_MEMORY ? " (out of memory)" : ""));
}

}  // namespace render
