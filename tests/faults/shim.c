/* Preloaded: one call that changes files below a folder fails, or the process is killed there, as faults_arm says.
 *
 * The calls are counted from 1. Built with -shared -fPIC. */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <limits.h>
#include <signal.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/types.h>
#include <unistd.h>

enum { FAIL_ONCE, FULL_FROM_HERE, KILL };

static char folder[PATH_MAX];
static long at, count;
static int how, error_number;

/* From now on the call number `place` below `path` fails with `error`, or is the last one. 0: none. */
void faults_arm(const char *path, long place, int kind, int error)
{
    snprintf(folder, sizeof folder, "%s", path);
    at = place, how = kind, error_number = error, count = 0;
}

long faults_count(void)
{
    return count;
}

static int below(const char *path)
{
    return folder[0] && strncmp(path, folder, strlen(folder)) == 0;
}

static int open_below(int file)
{
    char link[64], path[PATH_MAX];
    snprintf(link, sizeof link, "/proc/self/fd/%d", file);
    const ssize_t length = readlink(link, path, sizeof path - 1);
    if (length < 0)
        return 0;
    path[length] = 0;
    return below(path);
}

/* Whether this call fails. A full disk still renames and removes. */
static int strikes(int takes_room)
{
    const long here = ++count;
    if (!at || here < at || (here > at && how != FULL_FROM_HERE))
        return 0;
    if (how == KILL)
        kill(getpid(), SIGKILL);
    if (how == FULL_FROM_HERE && !takes_room)
        return 0;
    errno = error_number;
    return 1;
}

#define REAL(type, name, parameters) \
    static type(*real) parameters; \
    if (!real) \
        real = (type(*) parameters)dlsym(RTLD_NEXT, name)

#define OPEN(function) \
    int function(const char *path, int flags, ...) \
    { \
        REAL(int, #function, (const char *, int, ...)); \
        va_list rest; \
        va_start(rest, flags); \
        const int mode = flags & (O_CREAT | O_TMPFILE) ? va_arg(rest, int) : 0; \
        va_end(rest); \
        if ((flags & (O_CREAT | O_WRONLY | O_RDWR)) && below(path) && strikes(1)) \
            return -1; \
        return real(path, flags, mode); \
    }
OPEN(open)
OPEN(open64)

ssize_t write(int file, const void *bytes, size_t size)
{
    REAL(ssize_t, "write", (int, const void *, size_t));
    if (open_below(file) && strikes(1)) {
        const int kept = errno;
        if (how == FULL_FROM_HERE && size > 1)
            real(file, bytes, size/2);      /* half of it still found room */
        errno = kept;
        return -1;
    }
    return real(file, bytes, size);
}

int fsync(int file)
{
    REAL(int, "fsync", (int));
    return open_below(file) && strikes(1) ? -1 : real(file);
}

int rename(const char *from, const char *to)
{
    REAL(int, "rename", (const char *, const char *));
    return below(to) && strikes(0) ? -1 : real(from, to);
}

int mkdir(const char *path, mode_t mode)
{
    REAL(int, "mkdir", (const char *, mode_t));
    return below(path) && strikes(1) ? -1 : real(path, mode);
}

int rmdir(const char *path)
{
    REAL(int, "rmdir", (const char *));
    return below(path) && strikes(0) ? -1 : real(path);
}

int unlink(const char *path)
{
    REAL(int, "unlink", (const char *));
    return below(path) && strikes(0) ? -1 : real(path);
}

int unlinkat(int file, const char *path, int flags)
{
    REAL(int, "unlinkat", (int, const char *, int));
    return (path[0] == '/' ? below(path) : open_below(file)) && strikes(0) ? -1 : real(file, path, flags);
}
