/* Ways into the kernel that Python does not have: compiled to a library, and called by escapes.py. */

#define _GNU_SOURCE
#include <errno.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/syscall.h>
#include <unistd.h>

/* A system call by the instruction, without the C library. */
long direct(long number, long a, long b, long c) {
#if defined(__x86_64__)
  long result;
  __asm__ volatile("syscall" : "=a"(result) : "a"(number), "D"(a), "S"(b), "d"(c) : "rcx", "r11", "memory");
  return result;
#else
  long result = syscall(number, a, b, c);
  return result < 0 ? -errno : result;
#endif
}

/* One of 32-bit x86, whose numbers are others: 20 is getpid there, 5 is open, 11 is execve. */
long of_32_bit(long number, long a, long b, long c) {
#if defined(__x86_64__)
  long result;
  __asm__ volatile("int $0x80" : "=a"(result) : "a"(number), "b"(a), "c"(b), "d"(c) : "r8", "r9", "r10", "r11", "memory");
  return (int)result;
#else
  (void)number, (void)a, (void)b, (void)c;
  return -ENOSYS;
#endif
}

/* The same call from machine code that is written while the program runs. */
long written(long number, long a, long b, long c) {
#if defined(__x86_64__)
  /* mov rax,rdi; mov rdi,rsi; mov rsi,rdx; mov rdx,rcx; syscall; ret */
  static const unsigned char code[] = {0x48, 0x89, 0xf8, 0x48, 0x89, 0xf7, 0x48, 0x89,
                                       0xd6, 0x48, 0x89, 0xca, 0x0f, 0x05, 0xc3};
  void *page = mmap(0, 4096, PROT_READ | PROT_WRITE | PROT_EXEC, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
  if (page == MAP_FAILED) return -errno;
  memcpy(page, code, sizeof code);
  return ((long (*)(long, long, long, long))page)(number, a, b, c);
#else
  return direct(number, a, b, c);
#endif
}
