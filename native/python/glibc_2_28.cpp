// Binds the module to the C library of 2018, glibc 2.28, that Blender itself is built against.
//
// Compiled on a newer system, calls of these functions ask for the newest version of each, and the
// module would not load on an older one, RHEL 9 with its glibc 2.34 say. What is defined here is
// taken instead by every object of the module, the static C++ library among them, and passes the
// call on to the version that the first glibc for the processor had, or does without. `./dev
// package` has auditwheel look for newer symbols, so a compiler or library that asks for another
// one is noticed.
#include <features.h>

#if defined(__GLIBC__) && (defined(__x86_64__) || defined(__aarch64__))

#include <fcntl.h>
#include <pthread.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <time.h>
#include <unistd.h>

#if defined(__x86_64__)
#define FIRST_VERSION "GLIBC_2.2.5"
#else
#define FIRST_VERSION "GLIBC_2.17"
#endif

// Declares first_NAME as the first version of NAME.
#define FIRST(result, name, ...)    \
  result first_##name(__VA_ARGS__); \
  __asm__(".symver first_" #name "," #name "@" FIRST_VERSION)

using Routine = void (*)();
using ThreadRoutine = void* (*)(void*);
using Destructor = void (*)(void*);

extern "C" {

FIRST(double, exp, double);
FIRST(double, log, double);
FIRST(double, pow, double, double);
FIRST(double, hypot, double, double);
FIRST(int, pthread_create, pthread_t*, const pthread_attr_t*, ThreadRoutine, void*);
FIRST(int, pthread_join, pthread_t, void**);
FIRST(int, pthread_once, pthread_once_t*, Routine);
FIRST(int, __pthread_key_create, pthread_key_t*, Destructor);

// Newer ones (2.29, hypot 2.35) compute the same; only errno is set without a detour.
double exp(double x) { return first_exp(x); }
double log(double x) { return first_log(x); }
double pow(double x, double y) { return first_pow(x, y); }
double hypot(double x, double y) { return first_hypot(x, y); }

// Since 2.34 they are in libc.so; before, libpthread.so has them, which Python has loaded.
int pthread_create(pthread_t* thread, const pthread_attr_t* attributes, ThreadRoutine routine,
                   void* argument) noexcept {
  return first_pthread_create(thread, attributes, routine, argument);
}
int pthread_join(pthread_t thread, void** result) { return first_pthread_join(thread, result); }
int pthread_once(pthread_once_t* once, Routine routine) {
  return first_pthread_once(once, routine);
}
// These names are glibc's own, which nobody else may take: that is what they are here for.
// NOLINTNEXTLINE(bugprone-reserved-identifier)
int __pthread_key_create(pthread_key_t* key, Destructor destructor) noexcept {
  return first___pthread_key_create(key, destructor);
}

// New in 2.30: until a time of any clock, where the first one knew that of the day alone.
int pthread_cond_clockwait(pthread_cond_t* condition, pthread_mutex_t* mutex, clockid_t clock,
                           const timespec* until) {
  constexpr long second = 1000000000;
  timespec now, day;
  clock_gettime(clock, &now);
  clock_gettime(CLOCK_REALTIME, &day);
  const long nanoseconds = day.tv_nsec + until->tv_nsec - now.tv_nsec + second;
  const timespec then = {day.tv_sec + until->tv_sec - now.tv_sec - 1 + nanoseconds / second,
                         nanoseconds % second};
  return pthread_cond_timedwait(condition, mutex, &then);
}

// A macro before 2.33; the call of the system has the same structure on 64 bits.
int stat(const char* path, struct stat* found) noexcept {
  return static_cast<int>(syscall(SYS_newfstatat, AT_FDCWD, path, found, 0));
}

// New in 2.32: tells shared_ptr that it need not count atomically. It always shall.
// NOLINTNEXTLINE(bugprone-reserved-identifier)
char __libc_single_threaded = 0;

}  // extern "C"

#endif
