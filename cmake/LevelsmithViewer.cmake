# Finds the packages that only the viewer needs. Without them the viewer is not built.

find_package(glfw3 CONFIG QUIET)
find_package(OpenGL QUIET COMPONENTS OpenGL)
find_path(LEVELSMITH_IMGUI_INCLUDE imgui/backends/imgui_impl_glfw.h)
find_library(LEVELSMITH_IMGUI_LIBRARY imgui)
find_library(LEVELSMITH_STB_LIBRARY stb)  # Debian's imgui uses the font rasteriser of stb
mark_as_advanced(LEVELSMITH_IMGUI_INCLUDE LEVELSMITH_IMGUI_LIBRARY LEVELSMITH_STB_LIBRARY)

if(glfw3_FOUND AND TARGET OpenGL::GL AND LEVELSMITH_IMGUI_INCLUDE AND LEVELSMITH_IMGUI_LIBRARY)
  add_library(levelsmith_imgui INTERFACE)
  add_library(Levelsmith::imgui ALIAS levelsmith_imgui)
  target_include_directories(levelsmith_imgui SYSTEM INTERFACE
    ${LEVELSMITH_IMGUI_INCLUDE} ${LEVELSMITH_IMGUI_INCLUDE}/imgui)
  target_link_libraries(levelsmith_imgui INTERFACE ${LEVELSMITH_IMGUI_LIBRARY})
  if(LEVELSMITH_STB_LIBRARY)
    target_link_libraries(levelsmith_imgui INTERFACE ${LEVELSMITH_STB_LIBRARY})
  endif()
else()
  message(STATUS "levelsmith-view is not built: it needs libglfw3-dev, libimgui-dev and libgl-dev")
  set(LEVELSMITH_VIEWER OFF)
endif()
