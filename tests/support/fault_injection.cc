// Preloaded into a program under test (LD_PRELOAD): one of its system calls on files below a folder fails, or one of
// its allocations. See fault_run.h for the environment variables that say which. Also for measuring (bench.sh): what
// waiting for the disk costs.
#include <dlfcn.h>
#include <execinfo.h>
#include <fcntl.h>
#include <limits.h>
#include <pthread.h>
#include <signal.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <sys/uio.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <cstdint>
#include <new>

namespace {

enum class Kind { kNone, kWrite, kRead, kMemory };

Kind g_kind = Kind::kNone;
const char* g_below = "";
std::size_t g_below_length = 0;
long g_at = 0;  // which one fails; 0: none, they are counted
int g_log = -1;
bool g_timed_flushes = false;
std::atomic<long> g_count{0};
std::atomic<bool> g_armed{false};  // memory: once the program's main part has begun

void Log(const char* what, long n, const char* call, const char* path) {
  char line[PATH_MAX + 100];
  const int size = snprintf(line, sizeof line, "%s %ld %s %s\n", what, n, call, path);
  if (g_log >= 0) syscall(SYS_write, g_log, line, static_cast<std::size_t>(size));
}

// Whether this is the program that is meant, not one that it starts.
bool IsMeant() {
  const char* wanted = getenv("LUMI_FAULT_PROGRAM");
  char self[PATH_MAX] = {};
  if (!wanted || readlink("/proc/self/exe", self, sizeof self - 1) <= 0) return false;
  const char* slash = strrchr(self, '/');
  return strcmp(slash ? slash + 1 : self, wanted) == 0;
}

// In every program of the suite, the others that they start left alone.
void TimeFlushes(const char* log) {
  char self[PATH_MAX] = {};
  if (readlink("/proc/self/exe", self, sizeof self - 1) <= 0 || !strstr(self, "/lumi-")) return;
  g_timed_flushes = true;
  g_log = static_cast<int>(syscall(SYS_openat, AT_FDCWD, log, O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0600));
}

template <typename Flush>
int Flushed(Flush* flush, int fd) {
  if (!g_timed_flushes) return flush(fd);
  timespec begin = {}, end = {};
  clock_gettime(CLOCK_MONOTONIC, &begin);
  const int result = flush(fd);
  const int error = errno;
  clock_gettime(CLOCK_MONOTONIC, &end);
  Log("flushed", (end.tv_sec - begin.tv_sec) * 1000000L + (end.tv_nsec - begin.tv_nsec) / 1000, "us", "");
  errno = error;
  return result;
}

__attribute__((constructor)) void Begin() {
  if (const char* log = getenv("LUMI_FLUSH_LOG")) TimeFlushes(log);
  const char *below = getenv("LUMI_FAULT_BELOW"), *kind = getenv("LUMI_FAULT_KIND"), *at = getenv("LUMI_FAULT_AT"),
             *log = getenv("LUMI_FAULT_LOG");
  if (!below || !kind || !at || !log || !IsMeant()) return;
  g_below = below;
  g_below_length = strlen(below);
  g_at = atol(at);
  g_log = static_cast<int>(syscall(SYS_openat, AT_FDCWD, log, O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0600));
  g_kind = strcmp(kind, "memory") == 0 ? Kind::kMemory : strcmp(kind, "read") == 0 ? Kind::kRead : Kind::kWrite;
  // A program that starts itself again: allocations are counted in one process, which alone serves runs.
  if (g_kind == Kind::kMemory) unsetenv("LUMI_FAULT_BELOW");
}

// Whether this call is the one that fails.
bool Fails(Kind kind, const char* call, const char* path) {
  if (g_kind != kind || !path || strncmp(path, g_below, g_below_length) != 0) return false;
  const int before = errno;
  const long n = ++g_count;
  if (g_at == 0) Log("call", n, call, path);
  if (n == g_at) Log("failed", n, call, path);
  errno = before;
  return n == g_at;
}

bool FailsOn(Kind kind, const char* call, int fd) {
  if (g_kind != kind || fd <= 2) return false;
  const int before = errno;
  char link[64], path[PATH_MAX] = {};
  snprintf(link, sizeof link, "/proc/self/fd/%d", fd);
  const bool known = readlink(link, path, sizeof path - 1) > 0;
  errno = before;
  return known && Fails(kind, call, path);
}

template <typename F>
F* Real(const char* name) {
  return reinterpret_cast<F*>(dlsym(RTLD_NEXT, name));
}

int With(int error) {
  errno = error;
  return -1;
}

bool FailsOpening(const char* path, int flags) {
  const bool writes = (flags & O_ACCMODE) != O_RDONLY || (flags & O_CREAT) != 0;
  if (writes) return Fails(Kind::kWrite, "open", path);
  return (flags & O_DIRECTORY) == 0 && Fails(Kind::kRead, "open", path);
}

// A program that says something where it crashes crashes all the same: where is logged.
sighandler_t g_after_crash = SIG_DFL;
void LogCrash(int number) {
  Log("crashed", number, "", "");
  void* frames[24];
  if (g_log >= 0) backtrace_symbols_fd(frames, backtrace(frames, 24), g_log);
  g_after_crash(number);
}

// Loading its libraries takes a program longer than failing. Here, before its main part, it becomes the server of its
// own runs: it loads what it would load later, and each line "AT LOG OUT ERR" on the pipe `asked` forks a run with that
// fault, whose wait status goes to the pipe `told`. Returns in the forked process, or where no server is wanted.
void ServeRuns() {
  const char *folder = getenv("LUMI_FAULT_SERVER"), *load = getenv("LUMI_FAULT_LOAD");
  if (!folder || !load) return;
  char libraries[2 * PATH_MAX];
  snprintf(libraries, sizeof libraries, "%s", load);
  char* rest = nullptr;
  for (char* name = strtok_r(libraries, ":", &rest); name; name = strtok_r(nullptr, ":", &rest))
    if (!dlopen(name, RTLD_LAZY | RTLD_LOCAL)) _exit(127);
  const auto opened = [&](const char* name, int flags) {
    char path[PATH_MAX];
    snprintf(path, sizeof path, "%s/%s", folder, name);
    return static_cast<int>(syscall(SYS_openat, AT_FDCWD, path, flags | O_CLOEXEC, 0600));
  };
  FILE* const asked = fdopen(opened("asked", O_RDONLY), "r");
  const int told = opened("told", O_WRONLY);
  if (!asked || told < 0) _exit(127);
  char line[256];
  while (fgets(line, sizeof line, asked)) {
    char log[64], out[64], err[64];
    long at = 0;
    if (sscanf(line, "%ld %63s %63s %63s", &at, log, out, err) != 4) _exit(127);
    const pid_t run = fork();
    if (run == 0) {
      g_at = at;
      g_log = opened(log, O_WRONLY | O_CREAT | O_APPEND);
      dup2(opened(out, O_WRONLY | O_CREAT | O_TRUNC), 1);
      dup2(opened(err, O_WRONLY | O_CREAT | O_TRUNC), 2);
      return;
    }
    int status = 0;
    while (waitpid(run, &status, 0) < 0 && errno == EINTR) {
    }
    dprintf(told, "%d\n", status);
  }
  _exit(0);
}

// Of both kinds of shortage each has its turn.
int OpenError() { return g_kind == Kind::kRead || g_at % 2 != 0 ? EMFILE : ENOSPC; }

mode_t ModeOf(int flags, va_list list) { return flags & (O_CREAT | O_TMPFILE) ? va_arg(list, mode_t) : 0; }

}  // namespace

#define REAL(name) static auto* const real = Real<decltype(::name)>(#name)

extern "C" {

int open(const char* path, int flags, ...) {
  REAL(open);
  va_list list;
  va_start(list, flags);
  const mode_t mode = ModeOf(flags, list);
  va_end(list);
  return FailsOpening(path, flags) ? With(OpenError()) : real(path, flags, mode);
}
int open64(const char* path, int flags, ...) {
  REAL(open64);
  va_list list;
  va_start(list, flags);
  const mode_t mode = ModeOf(flags, list);
  va_end(list);
  return FailsOpening(path, flags) ? With(OpenError()) : real(path, flags, mode);
}
int openat(int folder, const char* path, int flags, ...) {
  REAL(openat);
  va_list list;
  va_start(list, flags);
  const mode_t mode = ModeOf(flags, list);
  va_end(list);
  return FailsOpening(path, flags) ? With(OpenError()) : real(folder, path, flags, mode);
}
FILE* fopen(const char* path, const char* mode) {
  REAL(fopen);
  if (!FailsOpening(path, strpbrk(mode, "wa+") ? O_WRONLY : O_RDONLY)) return real(path, mode);
  errno = OpenError();
  return nullptr;
}
FILE* fopen64(const char* path, const char* mode) {
  REAL(fopen64);
  if (!FailsOpening(path, strpbrk(mode, "wa+") ? O_WRONLY : O_RDONLY)) return real(path, mode);
  errno = OpenError();
  return nullptr;
}
int fclose(FILE* file) {
  REAL(fclose);
  const bool writes = (fcntl(fileno(file), F_GETFL) & O_ACCMODE) != O_RDONLY;
  const bool fails = writes && FailsOn(Kind::kWrite, "fclose", fileno(file));
  const int result = real(file);
  return fails ? With(ENOSPC) : result;
}
size_t fwrite(const void* data, size_t size, size_t count, FILE* file) {
  REAL(fwrite);
  if (!FailsOn(Kind::kWrite, "fwrite", fileno(file))) return real(data, size, count, file);
  errno = ENOSPC;
  return 0;
}
ssize_t write(int fd, const void* data, size_t size) {
  REAL(write);
  return FailsOn(Kind::kWrite, "write", fd) ? With(ENOSPC) : real(fd, data, size);
}
ssize_t writev(int fd, const struct iovec* parts, int count) {
  REAL(writev);
  return FailsOn(Kind::kWrite, "writev", fd) ? With(ENOSPC) : real(fd, parts, count);
}
ssize_t pwrite(int fd, const void* data, size_t size, off_t at) {
  REAL(pwrite);
  return FailsOn(Kind::kWrite, "pwrite", fd) ? With(ENOSPC) : real(fd, data, size, at);
}
ssize_t pwrite64(int fd, const void* data, size_t size, off64_t at) {
  REAL(pwrite64);
  return FailsOn(Kind::kWrite, "pwrite", fd) ? With(ENOSPC) : real(fd, data, size, at);
}
ssize_t copy_file_range(int in, off64_t* in_at, int out, off64_t* out_at, size_t size, unsigned flags) {
  REAL(copy_file_range);
  return FailsOn(Kind::kWrite, "copy", out) ? With(ENOSPC) : real(in, in_at, out, out_at, size, flags);
}
int ftruncate(int fd, off_t size) noexcept {
  REAL(ftruncate);
  return FailsOn(Kind::kWrite, "ftruncate", fd) ? With(ENOSPC) : real(fd, size);
}
int ftruncate64(int fd, off64_t size) noexcept {
  REAL(ftruncate64);
  return FailsOn(Kind::kWrite, "ftruncate", fd) ? With(ENOSPC) : real(fd, size);
}
int fsync(int fd) {
  REAL(fsync);
  return FailsOn(Kind::kWrite, "fsync", fd) ? With(EIO) : Flushed(real, fd);
}
int fdatasync(int fd) {
  REAL(fdatasync);
  return FailsOn(Kind::kWrite, "fsync", fd) ? With(EIO) : Flushed(real, fd);
}
int syncfs(int fd) noexcept {
  REAL(syncfs);
  return FailsOn(Kind::kWrite, "syncfs", fd) ? With(EIO) : Flushed(real, fd);
}
int rename(const char* from, const char* to) noexcept {
  REAL(rename);
  return Fails(Kind::kWrite, "rename", to) ? With(EIO) : real(from, to);
}
int link(const char* from, const char* to) noexcept {
  REAL(link);
  return Fails(Kind::kWrite, "link", to) ? With(EIO) : real(from, to);
}
int symlink(const char* from, const char* to) noexcept {
  REAL(symlink);
  return Fails(Kind::kWrite, "symlink", to) ? With(EIO) : real(from, to);
}
int mkdir(const char* path, mode_t mode) noexcept {
  REAL(mkdir);
  return Fails(Kind::kWrite, "mkdir", path) ? With(ENOSPC) : real(path, mode);
}
void* mmap(void* where, size_t size, int protection, int flags, int fd, off_t at) noexcept {
  REAL(mmap);
  const bool writes = (flags & MAP_SHARED) != 0 && (protection & PROT_WRITE) != 0;
  if (fd < 0 || !FailsOn(writes ? Kind::kWrite : Kind::kRead, "mmap", fd))
    return real(where, size, protection, flags, fd, at);
  errno = ENOMEM;
  return MAP_FAILED;
}
void* mmap64(void* where, size_t size, int protection, int flags, int fd, off64_t at) noexcept {
  REAL(mmap64);
  const bool writes = (flags & MAP_SHARED) != 0 && (protection & PROT_WRITE) != 0;
  if (fd < 0 || !FailsOn(writes ? Kind::kWrite : Kind::kRead, "mmap", fd))
    return real(where, size, protection, flags, fd, at);
  errno = ENOMEM;
  return MAP_FAILED;
}

// The programs set this where their main part begins (interrupt.cc); allocations before, of static objects, are not
// made to fail.
sighandler_t signal(int number, sighandler_t handler) noexcept {
  REAL(signal);
  if (number == SIGSEGV || number == SIGABRT || number == SIGBUS || number == SIGFPE || number == SIGILL) {
    if (g_kind != Kind::kMemory || handler == SIG_DFL) return real(number, handler);
    g_after_crash = handler;
    return real(number, LogCrash);
  }
  if (number == SIGPIPE && g_kind == Kind::kMemory && !g_armed) {
    ServeRuns();
    g_armed = true;
  }
  return real(number, handler);
}

}  // extern "C"

namespace {

// Call stacks seen, as hashes of their nearest frames.
constexpr std::size_t kTable = std::size_t{1} << 20;
constexpr int kFrames = 12;
std::uint64_t g_seen[kTable];
// Of calls into a graphics driver, how many call stacks were seen below each.
constexpr int kFramesOfDriver = 400;  // a shader compiler recurses deeply
constexpr std::size_t kMostDriverCalls = 4096;
struct {
  std::uint64_t hash;  // 0: free
  int stacks;
} g_driver_calls[kMostDriverCalls];
pthread_mutex_t g_mutex = PTHREAD_MUTEX_INITIALIZER;
thread_local bool t_inside = false;

// FNV-1a.
constexpr std::uint64_t kNoFrames = 1469598103934665603ULL;
std::uint64_t Mixed(std::uint64_t hash, std::uint64_t frame) { return (hash ^ frame) * 1099511628211ULL; }

bool IsNewStack() {
  void* frames[kFrames];
  const int n = backtrace(frames, kFrames);
  std::uint64_t hash = kNoFrames;
  for (int i = 2; i < n; ++i) hash = Mixed(hash, reinterpret_cast<std::uint64_t>(frames[i]));
  hash |= 1;
  pthread_mutex_lock(&g_mutex);
  std::size_t at = (hash >> 20) % kTable;
  while (g_seen[at] != 0 && g_seen[at] != hash) at = (at + 1) % kTable;
  const bool fresh = g_seen[at] == 0;
  g_seen[at] = hash;
  pthread_mutex_unlock(&g_mutex);
  return fresh;
}

// Where in its program or library a frame is: the same in every run.
std::uint64_t PlaceOf(const void* frame, const Dl_info& module) {
  return reinterpret_cast<std::uint64_t>(frame) - reinterpret_cast<std::uint64_t>(module.dli_fbase);
}

// The nearest frames by their places in program and libraries. What a library does while it is loaded is the same in
// every program: no frame from the loader on.
std::uint64_t StackName() {
  void* frames[kFrames];
  const int n = backtrace(frames, kFrames);
  std::uint64_t hash = kNoFrames;
  for (int i = 3; i < n; ++i) {
    Dl_info module = {};
    dladdr(frames[i], &module);
    if (module.dli_fname && strstr(module.dli_fname, "/ld-linux")) break;
    hash = Mixed(hash, PlaceOf(frames[i], module));
  }
  return hash;
}

bool IsOfDriver(const char* library) {
  for (const char* name : {"_dri.so", "libLLVM", "libgallium", "libGLX_mesa", "libEGL_mesa"})
    if (strstr(library, name)) return true;
  return false;
}

// By which call of ours an allocation inside a graphics driver came about: the driver's outermost frame and those
// nearest to it; 0 for other allocations.
std::uint64_t DriverCall() {
  void* frames[kFramesOfDriver];
  const int n = backtrace(frames, kFramesOfDriver);
  std::uint64_t hash = 0;
  int past = 0;
  for (int i = 3; i < n && past < kFrames; ++i) {
    Dl_info module = {};
    dladdr(frames[i], &module);
    const char* const library = module.dli_fname ? module.dli_fname : "";
    const bool is_standard = strstr(library, "libstdc++") != nullptr || strstr(library, "fault_injection") != nullptr;
    if (past == 0 && is_standard) continue;
    const std::uint64_t place = PlaceOf(frames[i], module);
    if (past == 0 && hash != 0 && strstr(library, "/ld-linux")) return kNoFrames;  // while it is loaded: all one call
    if (past == 0 && IsOfDriver(library)) {
      hash = Mixed(kNoFrames, place);
    } else if (hash == 0) {
      return 0;
    } else {
      hash = Mixed(hash, place);
      ++past;
    }
  }
  return hash;
}

// How many call stacks there were of that call, with this one.
int StacksOf(std::uint64_t driver_call) {
  pthread_mutex_lock(&g_mutex);
  std::size_t at = 0;
  while (g_driver_calls[at].hash != 0 && g_driver_calls[at].hash != driver_call) ++at;
  if (at + 1 == kMostDriverCalls) _exit(127);
  g_driver_calls[at].hash = driver_call;
  const int count = ++g_driver_calls[at].stacks;
  pthread_mutex_unlock(&g_mutex);
  return count;
}

// Of a driver's call stacks, whose shader compiler has thousands, the first, second, fourth, eighth ... of each call of
// ours fail; all others. 0: it is not among them. Else a name that is the same in every run.
std::uint64_t FailingStack() {
  const std::uint64_t call = DriverCall();
  if (call == 0) return StackName();
  const int n = StacksOf(call);
  return (n & (n - 1)) == 0 ? Mixed(call, static_cast<std::uint64_t>(n)) : 0;
}

// Where it happened, for a person: a line a frame.
void LogStack() {
  void* frames[2 * kFrames];
  backtrace_symbols_fd(frames, backtrace(frames, 2 * kFrames), g_log);
}

bool AllocationFails(std::size_t size) {
  if (!g_armed || t_inside) return false;
  t_inside = true;
  const long n = ++g_count;
  const std::uint64_t stack = g_at == 0 && IsNewStack() ? FailingStack() : 0;
  if (stack != 0) {
    char name[20];
    snprintf(name, sizeof name, "%016llx", static_cast<unsigned long long>(stack));
    Log("call", n, "new", name);
  }
  if (n == g_at) {
    Log("failed", n, "new", size < 1024 ? "small" : "large");
    LogStack();
  }
  t_inside = false;
  return n == g_at;
}

void* Allocate(std::size_t size, std::size_t alignment) {
  if (AllocationFails(size)) return nullptr;
  if (alignment <= alignof(max_align_t)) return malloc(size ? size : 1);
  return aligned_alloc(alignment, (size + alignment - 1) / alignment * alignment);
}

void* AllocateOrThrow(std::size_t size, std::size_t alignment) {
  void* const p = Allocate(size, alignment);
  if (!p) {
    if (const std::new_handler handler = std::get_new_handler()) handler();  // as the standard library's own
    throw std::bad_alloc();
  }
  return p;
}

// As the standard library's: the handler is asked here, too.
void* AllocateOrNull(std::size_t size) noexcept {
  try {
    return AllocateOrThrow(size, 1);
  } catch (...) {
    return nullptr;
  }
}

}  // namespace

void* operator new(std::size_t n) { return AllocateOrThrow(n, 1); }
void* operator new[](std::size_t n) { return AllocateOrThrow(n, 1); }
void* operator new(std::size_t n, std::align_val_t a) { return AllocateOrThrow(n, static_cast<std::size_t>(a)); }
void* operator new[](std::size_t n, std::align_val_t a) { return AllocateOrThrow(n, static_cast<std::size_t>(a)); }
void* operator new(std::size_t n, const std::nothrow_t&) noexcept { return AllocateOrNull(n); }
void* operator new[](std::size_t n, const std::nothrow_t&) noexcept { return AllocateOrNull(n); }
void operator delete(void* p) noexcept { free(p); }
void operator delete[](void* p) noexcept { free(p); }
void operator delete(void* p, std::size_t) noexcept { free(p); }
void operator delete[](void* p, std::size_t) noexcept { free(p); }
void operator delete(void* p, std::align_val_t) noexcept { free(p); }
void operator delete[](void* p, std::align_val_t) noexcept { free(p); }
void operator delete(void* p, std::size_t, std::align_val_t) noexcept { free(p); }
void operator delete[](void* p, std::size_t, std::align_val_t) noexcept { free(p); }
void operator delete(void* p, const std::nothrow_t&) noexcept { free(p); }
void operator delete[](void* p, const std::nothrow_t&) noexcept { free(p); }
