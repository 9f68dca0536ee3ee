#include "render/gl/gl_objects.h"

#include <epoxy/gl.h>
#include <fmt/format.h>

#include <algorithm>
#include <initializer_list>
#include <stdexcept>
#include <vector>

#include "scene/program/error.h"
#include "scene/program/out_of_memory.h"

namespace lumi {
namespace {

GLuint Compile(GLenum kind, const std::string& name, const std::string& text) {
  const GLuint shader = glCreateShader(kind);
  const char* source = text.c_str();
  glShaderSource(shader, 1, &source, nullptr);
  glCompileShader(shader);
  GLint ok = 0;
  glGetShaderiv(shader, GL_COMPILE_STATUS, &ok);
  if (!ok) {
    std::vector<char> log(8192);
    glGetShaderInfoLog(shader, static_cast<GLsizei>(log.size()), nullptr, log.data());
    glDeleteShader(shader);
    const char* what = kind == GL_VERTEX_SHADER ? "vertex" : kind == GL_COMPUTE_SHADER ? "compute" : "fragment";
    throw std::logic_error(fmt::format("{} shader '{}' does not compile: {}", what, name, log.data()));
  }
  return shader;
}

// Takes the shaders: they are gone afterwards.
GLuint Link(const std::string& name, std::initializer_list<GLuint> shaders) {
  const GLuint program = glCreateProgram();
  for (const GLuint s : shaders) glAttachShader(program, s);
  glLinkProgram(program);
  for (const GLuint s : shaders) glDeleteShader(s);
  GLint ok = 0;
  glGetProgramiv(program, GL_LINK_STATUS, &ok);
  if (!ok) {
    std::vector<char> log(8192);
    glGetProgramInfoLog(program, static_cast<GLsizei>(log.size()), nullptr, log.data());
    glDeleteProgram(program);
    throw std::logic_error(fmt::format("shader program '{}' does not link: {}", name, log.data()));
  }
  return program;
}

}  // namespace

template <GlKind kKind>
GlObject<kKind> GlObject<kKind>::Make() {
  GlObject o;
  if constexpr (kKind == GlKind::kBuffer) glGenBuffers(1, &o.id_);
  if constexpr (kKind == GlKind::kTexture) glGenTextures(1, &o.id_);
  if constexpr (kKind == GlKind::kFramebuffer) glGenFramebuffers(1, &o.id_);
  if constexpr (kKind == GlKind::kVertexArray) glGenVertexArrays(1, &o.id_);
  return o;
}

bool CanTearDownGl() { return !MemoryRanOut(); }

template <GlKind kKind>
void GlObject<kKind>::Release() {
  if (id_ == 0 || !CanTearDownGl()) return;
  if constexpr (kKind == GlKind::kBuffer) glDeleteBuffers(1, &id_);
  if constexpr (kKind == GlKind::kTexture) glDeleteTextures(1, &id_);
  if constexpr (kKind == GlKind::kFramebuffer) glDeleteFramebuffers(1, &id_);
  if constexpr (kKind == GlKind::kVertexArray) glDeleteVertexArrays(1, &id_);
  id_ = 0;
}

template class GlObject<GlKind::kBuffer>;
template class GlObject<GlKind::kTexture>;
template class GlObject<GlKind::kFramebuffer>;
template class GlObject<GlKind::kVertexArray>;

void FillBuffer(GLenum target, GlBuffer& buffer, const void* data, std::size_t bytes) {
  if (!buffer) buffer = GlBuffer::Make();
  glBindBuffer(target, buffer.id());
  glBufferData(target, static_cast<GLsizeiptr>(std::max<std::size_t>(bytes, 16)), nullptr, GL_STREAM_DRAW);
  if (data != nullptr && bytes > 0) glBufferSubData(target, 0, static_cast<GLsizeiptr>(bytes), data);
}

void FillTextureBuffer(GlBuffer& buffer, GlTexture& texture, GLenum format, const void* data, std::size_t bytes) {
  FillBuffer(GL_TEXTURE_BUFFER, buffer, data, bytes);
  if (texture) return;
  texture = GlTexture::Make();
  glBindTexture(GL_TEXTURE_BUFFER, texture.id());
  glTexBuffer(GL_TEXTURE_BUFFER, format, buffer.id());
}

GlTexture MakePictureTexture(GLenum format, int width, int height) {
  GlTexture texture = GlTexture::Make();
  glBindTexture(GL_TEXTURE_2D, texture.id());
  glTexStorage2D(GL_TEXTURE_2D, 1, format, width, height);
  for (const GLenum filter : {GL_TEXTURE_MIN_FILTER, GL_TEXTURE_MAG_FILTER})
    glTexParameteri(GL_TEXTURE_2D, filter, GL_LINEAR);
  for (const GLenum wrap : {GL_TEXTURE_WRAP_S, GL_TEXTURE_WRAP_T})
    glTexParameteri(GL_TEXTURE_2D, wrap, GL_CLAMP_TO_EDGE);
  return texture;
}

GlProgram::GlProgram(const std::string& name, const std::string& vertex, const std::string& fragment) {
  const GLuint v = Compile(GL_VERTEX_SHADER, name, vertex);
  GLuint f = 0;
  try {
    f = Compile(GL_FRAGMENT_SHADER, name, fragment);
  } catch (...) {
    glDeleteShader(v);
    throw;
  }
  id_ = Link(name, {v, f});
}

GlProgram::GlProgram(const std::string& name, const std::string& compute)
    : id_(Link(name, {Compile(GL_COMPUTE_SHADER, name, compute)})) {}

GlProgram::~GlProgram() {
  if (id_ != 0 && CanTearDownGl()) glDeleteProgram(id_);
}

void GlProgram::Use() const { glUseProgram(id_); }

int GlProgram::Uniform(const char* name) const { return glGetUniformLocation(id_, name); }

void RequireGl43() {
  const int version = epoxy_gl_version();
  if (!epoxy_is_desktop_gl() || version < 43)
    throw MachineError(fmt::format("OpenGL 4.3 is needed, this machine's driver ({}) offers {}.{}", GlDeviceName(),
                                   version / 10, version % 10),
                       "render with --backend cpu, or update the graphics driver");
}

void CheckGl(const char* doing) {
  const GLenum error = glGetError();
  if (error == GL_NO_ERROR) return;
  while (glGetError() != GL_NO_ERROR) {
  }
  if (error == GL_OUT_OF_MEMORY)
    throw MachineError(fmt::format("the graphics memory is full ({})", doing),
                       "use fewer or smaller photos, or --backend cpu");
  throw std::logic_error(fmt::format("OpenGL error 0x{:04x} while {}", error, doing));
}

std::string GlDeviceName() {
  const auto* name = reinterpret_cast<const char*>(glGetString(GL_RENDERER));
  return name != nullptr ? name : "no OpenGL";
}

bool GlIsSoftware() {
  const std::string name = GlDeviceName();
  for (const char* word : {"llvmpipe", "softpipe", "SwiftShader", "swrast"})
    if (name.find(word) != std::string::npos) return true;
  return false;
}

}  // namespace lumi
