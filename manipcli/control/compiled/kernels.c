/* Kernels of the control tick, the laws of manipcli/control for all joints of a controller in one call, and of pictures.
 *
 * Each kernel computes what a law in Python computes with numpy, operation by operation and in the same order, so that
 * both give the same bits: no fused multiply-add (-ffp-contract=off), no sums over joints. The law in Python is the
 * definition; tests/control/compiled compares them.
 *
 *     run = kernels.bind("errors", 7, reference, position, velocity, errors).run
 *     run(bound)
 *
 * `bind` takes the arrays once, checks their types and lengths, and holds them; `run` takes what changes.
 */

#define Py_LIMITED_API 0x030B0000
#define PY_SSIZE_T_CLEAN
#include <Python.h>

#include <math.h>
#include <stdint.h>
#include <string.h>

#ifndef SOURCE_CRC
#define SOURCE_CRC 0
#endif

typedef Py_ssize_t Size;
typedef struct Kernel Kernel;
typedef PyObject *(*Run)(Kernel *self, PyObject *const *args);

/* `fields` has two characters per array: its type (d: float64, i: int64, b: bool; a capital is written) and its length
 * as a multiple of n (0: any). The fields after | repeat. */
typedef struct {
    const char *name;
    const char *fields;
    Size args;
    Run run;
    const char *(*wrong)(const Kernel *self); /* what is inconsistent in the arrays, or NULL */
} Law;

struct Kernel {
    PyObject_HEAD
    const Law *law;
    Size n;
    Size count;
    Py_buffer *arrays;
};

static double *doubles(const Kernel *self, Size k) { return (double *)self->arrays[k].buf; }
static int64_t *integers(const Kernel *self, Size k) { return (int64_t *)self->arrays[k].buf; }
static unsigned char *flags(const Kernel *self, Size k) { return (unsigned char *)self->arrays[k].buf; }
static Size length(const Kernel *self, Size k) { return self->arrays[k].len / self->arrays[k].itemsize; }

/* Whether a buffer, requested with PyBUF_FORMAT, has elements of a type: d double, i int64, else bool. */
static int has_type(const Py_buffer *view, char type)
{
    const char *found = view->format ? view->format : "B";
    if (type == 'd') return strcmp(found, "d") == 0;
    if (type == 'i') return view->itemsize == 8 && (strcmp(found, "l") == 0 || strcmp(found, "q") == 0);
    return strcmp(found, "?") == 0;
}

/* numpy's maximum and minimum: NaN wins; of two zeros, the one that the processor's instruction chooses: the larger and
 * the smaller by sign on ARM, the second operand on x86. */
#if defined(__aarch64__) || defined(_M_ARM64)
static double larger(double a, double b) { return a != a || a > b || (a == b && signbit(b)) ? a : b; }
static double smaller(double a, double b) { return a != a || a < b || (a == b && signbit(a)) ? a : b; }
#else
static double larger(double a, double b) { return a != a || a > b ? a : b; }
static double smaller(double a, double b) { return a != a || a < b ? a : b; }
#endif

/* Reads a float argument; false with a Python error set. */
static int number(PyObject *value, double *found)
{
    *found = PyFloat_AsDouble(value);
    return !(*found == -1.0 && PyErr_Occurred());
}

static int indices_within(const Kernel *self, Size k, Size bound)
{
    for (Size j = 0; j < length(self, k); j++)
        if (integers(self, k)[j] < 0 || integers(self, k)[j] >= bound) return 0;
    return 1;
}

/* errors: reference minus measurement of positions and velocities. run(bound) -> whether each is below it. */
static PyObject *run_errors(Kernel *self, PyObject *const *args)
{
    enum { REFERENCE, POSITION, VELOCITY, ERRORS };
    const double *reference = doubles(self, REFERENCE);
    const double *position = doubles(self, POSITION), *velocity = doubles(self, VELOCITY);
    double *errors = doubles(self, ERRORS), bound;
    Size n = self->n;
    int below = 1;
    if (!number(args[0], &bound)) return NULL;
    for (Size j = 0; j < n; j++) {
        errors[j] = reference[j] - position[j];
        errors[n + j] = reference[n + j] - velocity[j];
        below &= fabs(errors[j]) < bound && fabs(errors[n + j]) < bound; /* NaN is not */
    }
    return PyBool_FromLong(below);
}

/* pid: Pid.apply, then the feed-forward where asked, then the clamp to -+ effort. run(dt, with_feed) */
static PyObject *run_pid(Kernel *self, PyObject *const *args)
{
    enum { ERRORS, GAINS, I, COUNTED, U_MIN, U_MAX, I_MIN, I_MAX, TRACKS, UNWINDING, CONDITIONAL, INTEGRAL_MIN,
           INTEGRAL_MAX, TERM, INTEGRAL, FEED, EFFORT, COMMAND, SWITCHES };
    enum { IS_PD, ROS1, HAS_I, CLAMPS_U, CLAMPS_I, ANY_TRACKS, ANY_CONDITIONAL, HAS_DEADBAND };
    const double *errors = doubles(self, ERRORS), *gains = doubles(self, GAINS), *i = doubles(self, I);
    const double *counted = doubles(self, COUNTED), *u_min = doubles(self, U_MIN), *u_max = doubles(self, U_MAX);
    const double *i_min = doubles(self, I_MIN), *i_max = doubles(self, I_MAX), *unwinding = doubles(self, UNWINDING);
    const double *least = doubles(self, INTEGRAL_MIN), *most = doubles(self, INTEGRAL_MAX);
    const double *feed = doubles(self, FEED), *effort = doubles(self, EFFORT);
    const unsigned char *tracks = flags(self, TRACKS), *conditional = flags(self, CONDITIONAL);
    const unsigned char *switches = flags(self, SWITCHES);
    double *term = doubles(self, TERM), *integral = doubles(self, INTEGRAL), *command = doubles(self, COMMAND), dt;
    Size n = self->n;
    int with_feed = args[1] == Py_True;
    if (!number(args[0], &dt)) return NULL;
    for (Size j = 0; j < n; j++) {
        double e = errors[j], u = gains[j] * e + gains[n + j] * errors[n + j];
        if (!switches[IS_PD]) {
            double count = !switches[HAS_DEADBAND] || fabs(e) > counted[j] ? e : 0.0, unsaturated;
            if (switches[ROS1]) {
                integral[j] += dt * count;
                if (conditional[j]) integral[j] = smaller(larger(integral[j], least[j]), most[j]);
                term[j] = smaller(larger(i[j] * integral[j], i_min[j]), i_max[j]);
            }
            if (switches[HAS_I]) u += term[j];
            unsaturated = u;
            if (switches[CLAMPS_U]) u = smaller(larger(u, u_min[j]), u_max[j]);
            if (switches[HAS_I] && !switches[ROS1]) {
                double step = i[j] * count;
                if (switches[ANY_TRACKS]) step += (double)tracks[j] * (u - unsaturated) * unwinding[j];
                if (conditional[j] && u != unsaturated && e * unsaturated > 0.0) step = 0.0;
                term[j] += step * dt;
                if (switches[CLAMPS_I]) term[j] = smaller(larger(term[j], i_min[j]), i_max[j]);
            }
        }
        if (with_feed) u += feed[j];
        command[j] = smaller(larger(u, -effort[j]), effort[j]);
    }
    Py_RETURN_NONE;
}

static const char *wrong_pid(const Kernel *self) { return length(self, 18) == 8 ? NULL : "expected 8 switches"; }

/* sample: Reference.advance at a time that is sampled. run(time, period) -> the row, or -1: it is not sampled. */
static PyObject *run_sample(Kernel *self, PyObject *const *args)
{
    enum { SAMPLES, FEEDS, CLOCK, ROWS, FEED };
    const double *clock = doubles(self, CLOCK);
    double time, period, ticks;
    Size n = self->n, k = length(self, FEED), row;
    if (!number(args[0], &time) || !number(args[1], &period)) return NULL;
    ticks = (time - clock[0]) / clock[1];
    if (!(fabs(ticks) < 1e15)) return PyLong_FromLong(-1);
    row = (Size)(ticks + 0.5);
    if (!((double)row < clock[2] && -clock[3] < ticks - row && ticks - row < clock[3] && period == clock[1]))
        return PyLong_FromLong(-1);
    if (row < 0 || (row + 1) * 4 * n > length(self, SAMPLES) || (length(self, FEEDS) && (row + 1) * k > length(self, FEEDS)))
        return PyLong_FromLong(-1);
    memcpy(doubles(self, ROWS), doubles(self, SAMPLES) + row * 4 * n, 3 * n * sizeof(double));
    if (length(self, FEEDS)) memcpy(doubles(self, FEED), doubles(self, FEEDS) + row * k, k * sizeof(double));
    return PyLong_FromSsize_t(row);
}

static const char *wrong_sample(const Kernel *self)
{
    return length(self, 2) == 4 ? NULL : "expected origin, period, last row and tolerance";
}

/* copies: target[index] = source, for each group. run() */
static PyObject *run_copies(Kernel *self, PyObject *const *args)
{
    (void)args;
    for (Size k = 0; k < self->count; k += 3) {
        double *target = doubles(self, k);
        const int64_t *index = integers(self, k + 1);
        const double *source = doubles(self, k + 2);
        for (Size j = 0; j < length(self, k + 1); j++) target[index[j]] = source[j];
    }
    Py_RETURN_NONE;
}

static const char *wrong_copies(const Kernel *self)
{
    for (Size k = 0; k < self->count; k += 3)
        if (length(self, k + 1) != length(self, k + 2) || !indices_within(self, k + 1, length(self, k)))
            return "an index does not fit its arrays";
    return NULL;
}

/* model_efforts: ModelFeedForward.add after the dynamics. run(efforts, damped); `efforts` (n) is overwritten. */
static PyObject *run_model_efforts(Kernel *self, PyObject *const *args)
{
    enum { DAMPING, RATE, FOLLOWERS, DRIVERS, FACTORS, GROUPS };
    const double *damping = doubles(self, DAMPING), *rate = doubles(self, RATE), *factors = doubles(self, FACTORS);
    const int64_t *followers = integers(self, FOLLOWERS), *drivers = integers(self, DRIVERS);
    Py_buffer view;
    double *efforts;
    if (PyObject_GetBuffer(args[0], &view, PyBUF_C_CONTIGUOUS | PyBUF_FORMAT | PyBUF_WRITABLE) < 0) return NULL;
    if (!has_type(&view, 'd')) {
        PyBuffer_Release(&view);
        PyErr_SetString(PyExc_TypeError, "efforts of another type than double");
        return NULL;
    }
    if (view.len != self->n * (Size)sizeof(double)) {
        PyBuffer_Release(&view);
        PyErr_SetString(PyExc_ValueError, "efforts of another number of joints");
        return NULL;
    }
    efforts = (double *)view.buf;
    if (args[1] == Py_True)
        for (Size j = 0; j < self->n; j++) efforts[j] += damping[j] * rate[j];
    for (Size k = 0; k < length(self, FOLLOWERS); k++) efforts[drivers[k]] += factors[k] * efforts[followers[k]];
    for (Size k = GROUPS; k < self->count; k += 2) {
        const int64_t *index = integers(self, k);
        double *command = doubles(self, k + 1);
        for (Size j = 0; j < length(self, k); j++) command[j] += efforts[index[j]];
    }
    PyBuffer_Release(&view);
    Py_RETURN_NONE;
}

static const char *wrong_model_efforts(const Kernel *self)
{
    if (length(self, 2) != length(self, 3) || length(self, 2) != length(self, 4)) return "followers of unequal number";
    if (!indices_within(self, 2, self->n) || !indices_within(self, 3, self->n)) return "an index of a follower is wrong";
    for (Size k = 5; k < self->count; k += 2)
        if (length(self, k) != length(self, k + 1) || !indices_within(self, k, self->n))
            return "an index does not fit its command";
    return NULL;
}

/* window: _Efforts.inside: fills the window's rows and compares them with their bounds. run() -> whether all hold. */
static PyObject *run_window(Kernel *self, PyObject *const *args)
{
    enum { POSITION, VELOCITY, EFFORT, KV, KV_KP, LEAST, MOST, VALUES, FLAGS };
    const double *position = doubles(self, POSITION), *velocity = doubles(self, VELOCITY);
    const double *effort = doubles(self, EFFORT), *least = doubles(self, LEAST), *most = doubles(self, MOST);
    double *values = doubles(self, VALUES);
    unsigned char *above = flags(self, FLAGS);
    Size n = self->n, size = length(self, VALUES);
    int all = 1;
    (void)args;
    memcpy(values, position, n * sizeof(double));
    memcpy(values + n, velocity, n * sizeof(double));
    memcpy(values + 2 * n, effort, n * sizeof(double));
    if (size > 3 * n) {
        const double *kv = doubles(self, KV), *kv_kp = doubles(self, KV_KP);
        for (Size j = 0; j < n; j++) {
            values[3 * n + j] = kv[j] * velocity[j] + effort[j];
            values[4 * n + j] = kv_kp[j] * position[j] + values[3 * n + j];
        }
    }
    for (Size k = 0; k < size; k++) {
        above[k] = values[k] > least[k];
        above[size + k] = values[k] < most[k];
        all &= above[k] & above[size + k];
    }
    return PyBool_FromLong(all);
}

static const char *wrong_window(const Kernel *self)
{
    Size size = length(self, 7);
    if (size != 3 * self->n && size != 5 * self->n) return "expected 3 or 5 rows";
    return length(self, 5) == size && length(self, 6) == size && length(self, 8) == 2 * size ? NULL
                                                                                              : "bounds of another size";
}

/* actuation: Actuation.apply without latency, each actuator at one joint. run() -> whether `applied` differs from the
 * command: false where every actuator is below its limits and has no friction. n is the number of actuators. */
static PyObject *run_actuation(Kernel *self, PyObject *const *args)
{
    enum { COMMAND, SPEED, JOINT, TO_EFFORT, TO_SPEED, EFFORT, VELOCITY, COULOMB, LOSS, DAMPING, TO_JOINT, PASS,
           SATURATED, SATURATIONS, APPLIED, SWITCHES };
    enum { SEES_VELOCITY, RUBS, PASSES };
    const double *command = doubles(self, COMMAND), *speed = doubles(self, SPEED);
    const double *to_effort = doubles(self, TO_EFFORT), *to_speed = doubles(self, TO_SPEED);
    const double *effort = doubles(self, EFFORT), *velocity = doubles(self, VELOCITY);
    const double *coulomb = doubles(self, COULOMB), *loss = doubles(self, LOSS), *damping = doubles(self, DAMPING);
    const double *to_joint = doubles(self, TO_JOINT), *pass = doubles(self, PASS);
    const int64_t *joint = integers(self, JOINT);
    const unsigned char *switches = flags(self, SWITCHES);
    unsigned char *saturated = flags(self, SATURATED);
    int64_t *saturations = integers(self, SATURATIONS);
    double *applied = doubles(self, APPLIED);
    Size a = self->n, n = length(self, APPLIED);
    int within = !switches[RUBS];
    (void)args;
    for (Size k = 0; within && k < a; k++) {
        within = fabs(0.0 + to_effort[k] * command[joint[k]]) <= effort[k];
        if (switches[SEES_VELOCITY]) within &= fabs(0.0 + to_speed[k] * speed[joint[k]]) <= velocity[k];
    }
    if (within) {
        memset(saturated, 0, a);
        Py_RETURN_FALSE;
    }
    memset(applied, 0, n * sizeof(double));
    for (Size k = 0; k < a; k++) {
        double wanted = 0.0 + to_effort[k] * command[joint[k]], v = 0.0, most = effort[k], least = -effort[k], given;
        if (switches[SEES_VELOCITY]) {
            v = 0.0 + to_speed[k] * speed[joint[k]];
            if (fabs(v) > velocity[k]) {
                if (v > 0.0) most = 0.0;
                if (v < 0.0) least = 0.0;
            }
        }
        given = larger(smaller(wanted, most), least);
        saturated[k] = given != wanted;
        saturations[k] += saturated[k];
        if (switches[RUBS]) {
            double friction = fabs(given) * loss[k] + coulomb[k];
            given -= larger(smaller(v * damping[k], friction), -friction);
            given -= v * damping[a + k];
        }
        applied[joint[k]] = 0.0 + to_joint[k] * given;
    }
    if (switches[PASSES])
        for (Size j = 0; j < n; j++) applied[j] += command[j] * pass[j];
    Py_RETURN_TRUE;
}

static const char *wrong_actuation(const Kernel *self)
{
    Size n = length(self, 14);
    if (length(self, 0) != n || length(self, 1) != n || length(self, 11) != n) return "vectors of unequal length";
    if (length(self, 15) != 3) return "expected 3 switches";
    return indices_within(self, 2, n) ? NULL : "an actuator's joint is wrong";
}

/* rows: rows[k] = source, for each group. run(k) */
static PyObject *run_rows(Kernel *self, PyObject *const *args)
{
    Size at = PyLong_AsSsize_t(args[0]);
    if (at == -1 && PyErr_Occurred()) return NULL;
    for (Size k = 0; k < self->count; k += 2) {
        Size width = length(self, k + 1);
        if (at < 0 || (at + 1) * width > length(self, k)) {
            PyErr_SetString(PyExc_IndexError, "no such row");
            return NULL;
        }
        memcpy(doubles(self, k) + at * width, doubles(self, k + 1), width * sizeof(double));
    }
    Py_RETURN_NONE;
}

static const char *wrong_rows(const Kernel *self)
{
    for (Size k = 0; k < self->count; k += 2)
        if (length(self, k + 1) == 0 || length(self, k) % length(self, k + 1)) return "rows of another width";
    return NULL;
}

/* raster: the triangles of surfaces seen by a pinhole camera, in a depth buffer. run()
 *
 * Homogeneous edge functions, so that no triangle is clipped: with A, B, C in the camera's frame and a ray d = (x, y, 1),
 * the weights of the corners are d.(BxC), d.(CxA) and d.(AxB), of one sign within the triangle, and the depth is
 * A.(BxC) over their sum. The edge of two triangles has the same value with the other sign in the other one, so that no
 * ray passes between them. */
static PyObject *run_raster(Kernel *self, PyObject *const *args)
{
    enum { VERTICES, NORMALS, FACES, FIRST_VERTEX, FIRST_FACE, POSES, LIGHTS, SHOWN, LENS, COLUMNS, ROWS, POINTS, DEPTH,
           FACE, SHADE, SLOPE };
    const double *vertices = doubles(self, VERTICES), *normals = doubles(self, NORMALS), *poses = doubles(self, POSES);
    const double *lights = doubles(self, LIGHTS), *lens = doubles(self, LENS);
    const double *columns = doubles(self, COLUMNS), *rows = doubles(self, ROWS);
    const int64_t *faces = integers(self, FACES), *first_vertex = integers(self, FIRST_VERTEX);
    const int64_t *first_face = integers(self, FIRST_FACE);
    const unsigned char *shown = flags(self, SHOWN);
    double *points = doubles(self, POINTS), *depth = doubles(self, DEPTH), *shade = doubles(self, SHADE);
    double *slope = doubles(self, SLOPE);
    int64_t *face = integers(self, FACE);
    const double fx = lens[0], fy = lens[1], cx = lens[2], cy = lens[3], near = lens[4], margin = lens[5];
    Size width = length(self, COLUMNS), height = length(self, ROWS);
    (void)args;
    Py_BEGIN_ALLOW_THREADS;
    for (Size k = 0; k < width * height; k++) {
        depth[k] = INFINITY;
        shade[k] = slope[k] = 0.0;
        face[k] = -1;
    }
    for (Size s = 0; s < self->n; s++) {
        const double *R = poses + 12 * s, *t = R + 9, *light = lights + 3 * s;
        if (!shown[s]) continue;
        for (Size k = first_vertex[s]; k < first_vertex[s + 1]; k++) {
            const double *v = vertices + 3 * k, *normal = normals + 3 * k;
            double *p = points + 6 * k;
            for (Size i = 0; i < 3; i++) p[i] = ((R[3 * i] * v[0] + R[3 * i + 1] * v[1]) + R[3 * i + 2] * v[2]) + t[i];
            p[3] = fx * (p[0] / p[2]) + cx;
            p[4] = fy * (p[1] / p[2]) + cy;
            p[5] = (normal[0] * light[0] + normal[1] * light[1]) + normal[2] * light[2];
        }
        for (Size f = first_face[s]; f < first_face[s + 1]; f++) {
            const double *a = points + 6 * faces[3 * f], *b = points + 6 * faces[3 * f + 1];
            const double *c = points + 6 * faces[3 * f + 2];
            double left = 0.0, right = (double)(width - 1), top = 0.0, bottom = (double)(height - 1), sign, det;
            double e[3][3], n[3], long_n;
            int ahead = (a[2] > near) + (b[2] > near) + (c[2] > near);
            if (ahead == 0) continue;
            if (ahead == 3) { /* else the projection of the corners does not bound that of the triangle */
                left = larger(left, ceil(smaller(smaller(a[3], b[3]), c[3]) - margin));
                right = smaller(right, floor(larger(larger(a[3], b[3]), c[3]) + margin));
                top = larger(top, ceil(smaller(smaller(a[4], b[4]), c[4]) - margin));
                bottom = smaller(bottom, floor(larger(larger(a[4], b[4]), c[4]) + margin));
            }
            if (!(left <= right && top <= bottom)) continue;
            for (Size i = 0; i < 3; i++) {
                Size j = (i + 1) % 3, k = (i + 2) % 3;
                e[0][i] = b[j] * c[k] - b[k] * c[j];
                e[1][i] = c[j] * a[k] - c[k] * a[j];
                e[2][i] = a[j] * b[k] - a[k] * b[j];
            }
            det = (a[0] * e[0][0] + a[1] * e[0][1]) + a[2] * e[0][2];
            if (det == 0.0) continue;
            sign = det > 0.0 ? 1.0 : -1.0; /* positive: seen from inside */
            for (Size i = 0; i < 3; i++) n[i] = (e[0][i] + e[1][i]) + e[2][i];
            long_n = sqrt((n[0] * n[0] + n[1] * n[1]) + n[2] * n[2]);
            for (Size y = (Size)top; y <= (Size)bottom; y++)
                for (Size x = (Size)left; x <= (Size)right; x++) {
                    double u = sign * ((e[0][0] * columns[x] + e[0][1] * rows[y]) + e[0][2]);
                    double v = sign * ((e[1][0] * columns[x] + e[1][1] * rows[y]) + e[1][2]);
                    double w = sign * ((e[2][0] * columns[x] + e[2][1] * rows[y]) + e[2][2]), sum, z;
                    Size at = y * width + x;
                    if (!(u >= 0.0 && v >= 0.0 && w >= 0.0)) continue;
                    sum = (u + v) + w;
                    z = (sign * det) / sum; /* sum 0: infinite or NaN, never nearer */
                    if (!(z > near && z < depth[at])) continue;
                    depth[at] = z;
                    face[at] = f;
                    shade[at] = -sign * (((u * a[5] + v * b[5]) + w * c[5]) / sum);
                    slope[at] = sum / long_n;
                }
        }
    }
    Py_END_ALLOW_THREADS;
    Py_RETURN_NONE;
}

/* Whether the surfaces cover the vertices and faces, which are arrays `vertices`, `faces` and the two of firsts. */
static const char *wrong_surfaces(const Kernel *self, Size vertices, Size faces, Size firsts)
{
    const int64_t *corner = integers(self, faces), *vertex = integers(self, firsts), *face = integers(self, firsts + 1);
    Size n = self->n;
    if (length(self, vertices) % 3 || length(self, faces) % 3) return "expected triples";
    if (length(self, firsts) != n + 1 || length(self, firsts + 1) != n + 1) return "expected the first of each surface";
    if (vertex[0] != 0 || face[0] != 0 || 3 * vertex[n] != length(self, vertices) || 3 * face[n] != length(self, faces))
        return "surfaces do not cover the vertices and faces";
    for (Size s = 0; s < n; s++) {
        if (vertex[s] > vertex[s + 1] || face[s] > face[s + 1]) return "surfaces out of order";
        for (Size k = 3 * face[s]; k < 3 * face[s + 1]; k++)
            if (corner[k] < vertex[s] || corner[k] >= vertex[s + 1]) return "a wrong vertex";
    }
    return NULL;
}

static const char *wrong_raster(const Kernel *self)
{
    Size pixels = length(self, 9) * length(self, 10);
    if (length(self, 0) != length(self, 1) || length(self, 5) != 12 * self->n || length(self, 8) != 6)
        return "vectors of another length";
    if (length(self, 11) != 2 * length(self, 0)) return "expected six numbers per point";
    for (Size k = 12; k < 16; k++)
        if (length(self, k) != pixels) return "wrong picture";
    return wrong_surfaces(self, 0, 2, 3);
}

/* scan: distances along rays in the plane z = 0 of a frame to the segments in which it cuts triangles. run()
 *
 * A ray through an end of a segment meets one of the two segments there: sides are half open. Angles only bound the rays
 * that are tried. */
static PyObject *run_scan(Kernel *self, PyObject *const *args)
{
    enum { VERTICES, FACES, FIRST_VERTEX, FIRST_FACE, POSES, SHOWN, ANGLES, RAYS, POINTS, DISTANCES };
    const double *vertices = doubles(self, VERTICES), *poses = doubles(self, POSES), *angles = doubles(self, ANGLES);
    const double *rays = doubles(self, RAYS);
    const int64_t *faces = integers(self, FACES), *first_vertex = integers(self, FIRST_VERTEX);
    const int64_t *first_face = integers(self, FIRST_FACE);
    const unsigned char *shown = flags(self, SHOWN);
    double *points = doubles(self, POINTS), *distances = doubles(self, DISTANCES);
    const double turn = 6.283185307179586;
    Size n = length(self, ANGLES);
    double step = n > 1 ? (angles[n - 1] - angles[0]) / (double)(n - 1) : 0.0;
    (void)args;
    for (Size k = 0; k < n; k++) distances[k] = INFINITY;
    for (Size s = 0; s < self->n; s++) {
        const double *R = poses + 12 * s, *t = R + 9;
        if (!shown[s]) continue;
        for (Size k = first_vertex[s]; k < first_vertex[s + 1]; k++) {
            const double *v = vertices + 3 * k;
            for (Size i = 0; i < 3; i++)
                points[3 * k + i] = ((R[3 * i] * v[0] + R[3 * i + 1] * v[1]) + R[3 * i + 2] * v[2]) + t[i];
        }
        for (Size f = first_face[s]; f < first_face[s + 1]; f++) {
            const double *corner[3] = {points + 3 * faces[3 * f], points + 3 * faces[3 * f + 1], points + 3 * faces[3 * f + 2]};
            int above[3] = {corner[0][2] >= 0.0, corner[1][2] >= 0.0, corner[2][2] >= 0.0};
            int count = above[0] + above[1] + above[2], alone = 0;
            double end[2][2], way[2], across, low, high;
            if (count == 0 || count == 3) continue;
            while (above[alone] != (count == 1)) alone++;
            for (int i = 0; i < 2; i++) {
                const double *p = corner[alone], *q = corner[(alone + 1 + i) % 3];
                double share = p[2] / (p[2] - q[2]);
                end[i][0] = p[0] + share * (q[0] - p[0]);
                end[i][1] = p[1] + share * (q[1] - p[1]);
            }
            way[0] = end[1][0] - end[0][0];
            way[1] = end[1][1] - end[0][1];
            across = end[0][0] * way[1] - end[0][1] * way[0];
            low = atan2(end[0][1], end[0][0]);
            high = atan2(end[1][1], end[1][0]);
            if (low > high) {
                double swapped = low;
                low = high;
                high = swapped;
            }
            if (high - low > turn / 2.0) {
                double swapped = low + turn;
                low = high;
                high = swapped;
            }
            for (int shift = -2; shift <= 2; shift++) {
                Size from = 0, to = n - 1;
                if (step > 0.0) {
                    double a = floor((low + shift * turn - angles[0]) / step) - 1.0;
                    double b = ceil((high + shift * turn - angles[0]) / step) + 1.0;
                    if (b < 0.0 || a > (double)(n - 1)) continue;
                    if (a > 0.0) from = (Size)a;
                    if (b < (double)(n - 1)) to = (Size)b;
                } else if (shift != 0) continue;
                for (Size k = from; k <= to; k++) {
                    const double *d = rays + 2 * k;
                    double one = d[0] * end[0][1] - d[1] * end[0][0], two = d[0] * end[1][1] - d[1] * end[1][0], r;
                    if ((one >= 0.0) == (two >= 0.0)) continue;
                    r = across / (d[0] * way[1] - d[1] * way[0]);
                    if (r > 0.0 && r < distances[k]) distances[k] = r;
                }
            }
        }
    }
    Py_RETURN_NONE;
}

static const char *wrong_scan(const Kernel *self)
{
    if (length(self, 8) != length(self, 0) || length(self, 4) != 12 * self->n) return "vectors of another length";
    if (length(self, 6) == 0 || length(self, 7) != 2 * length(self, 6) || length(self, 9) != length(self, 6)) return "wrong rays";
    return wrong_surfaces(self, 0, 1, 2);
}

/* sensor: SignalChain.step without the draw of its noise. run(tick) -> whether a measurement arrives. */
static PyObject *run_sensor(Kernel *self, PyObject *const *args)
{
    enum { TRUTH, LOW, NOISE, LOST, QUANTUM, LEAST, MOST, RING, RING_LOST, READING, BLEND, TIMES };
    const double *truth = doubles(self, TRUTH), *quantum = doubles(self, QUANTUM);
    const double *least = doubles(self, LEAST), *most = doubles(self, MOST);
    double *low = doubles(self, LOW), blend = *doubles(self, BLEND);
    int64_t every = integers(self, TIMES)[0], delay = integers(self, TIMES)[1];
    Size n = self->n, block = length(self, LOST), slots = length(self, RING_LOST);
    unsigned char *ring_lost = flags(self, RING_LOST);
    int64_t tick = PyLong_AsLongLong(args[0]);
    if (tick == -1 && PyErr_Occurred()) return NULL;
    if (tick < 0) {
        PyErr_SetString(PyExc_IndexError, "no such tick");
        return NULL;
    }
    for (Size j = 0; j < n; j++) low[j] = blend == 1.0 ? truth[j] : low[j] + blend * (truth[j] - low[j]);
    if (tick % every == 0) {
        int64_t k = tick / every;
        const double *noise = doubles(self, NOISE) + k % block * n;
        double *slot = doubles(self, RING) + k % slots * n;
        for (Size j = 0; j < n; j++) {
            double value = low[j] + noise[j];
            if (quantum[j] > 0.0) value = rint(value / quantum[j]) * quantum[j];
            slot[j] = smaller(larger(value, least[j]), most[j]);
        }
        ring_lost[k % slots] = flags(self, LOST)[k % block];
    }
    int64_t due = tick - delay;
    if (due < 0 || due % every || ring_lost[due / every % slots]) Py_RETURN_FALSE;
    memcpy(doubles(self, READING), doubles(self, RING) + due / every % slots * n, n * sizeof(double));
    Py_RETURN_TRUE;
}

static const char *wrong_sensor(const Kernel *self)
{
    if (length(self, 3) == 0 || length(self, 2) != self->n * length(self, 3)) return "noise of another size";
    if (length(self, 8) == 0 || length(self, 7) != self->n * length(self, 8)) return "measurements of another size";
    if (length(self, 10) != 1 || length(self, 11) != 2) return "expected 1 factor and 2 times";
    return integers(self, 11)[0] > 0 && integers(self, 11)[1] >= 0 ? NULL : "times below 0";
}

/* ---- motion of links: see manipcli/simulate/link_motion.py ---- */

/* R v, R' v and a x b, for a rotation R row by row; `out` is none of the arguments. */
static void out_of(const double *R, const double *v, double *out)
{
    for (int i = 0; i < 3; i++) out[i] = (R[3 * i] * v[0] + R[3 * i + 1] * v[1]) + R[3 * i + 2] * v[2];
}

static void into(const double *R, const double *v, double *out)
{
    for (int i = 0; i < 3; i++) out[i] = (R[i] * v[0] + R[3 + i] * v[1]) + R[6 + i] * v[2];
}

static void crossed(const double *a, const double *b, double *out)
{
    out[0] = a[1] * b[2] - a[2] * b[1];
    out[1] = a[2] * b[0] - a[0] * b[2];
    out[2] = a[0] * b[1] - a[1] * b[0];
}

static void product(const double *A, const double *B, double *out)
{
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++)
            out[3 * i + j] = (A[3 * i] * B[j] + A[3 * i + 1] * B[3 + j]) + A[3 * i + 2] * B[6 + j];
}

/* The first arrays of laws of links, and numbers of a frame's motion. */
enum { PARENT, KIND, INDEX, PLACEMENT, AXIS, BASE, POSITION, VELOCITY, CHAIN };
enum { TO_P = 9, TO_W = 12, TO_V = 15, TO_ALPHA = 18, TO_A = 21, MOTION = 24 };

/* travel: the motion of every frame; accelerations if `before` has the velocities of a `period` ago. */
static void travel(const Kernel *self, const double *before, double period, double *motion)
{
    enum { FIXED, REVOLUTE, PRISMATIC };
    const int64_t *parent = integers(self, PARENT), *kind = integers(self, KIND), *index = integers(self, INDEX);
    const double *position = doubles(self, POSITION), *velocity = doubles(self, VELOCITY);
    double root[MOTION] = {0.0};
    memcpy(root, doubles(self, BASE), 12 * sizeof(double));
    for (Size k = 0; k < self->n; k++) {
        const double *above = parent[k] < 0 ? root : motion + MOTION * parent[k], *w = above + TO_W;
        const double *placement = doubles(self, PLACEMENT) + 12 * k, *axis = doubles(self, AXIS) + 3 * k;
        double *to = motion + MOTION * k, q = 0.0, v = 0.0, r[3], e[3], swing[3];
        if (kind[k] != FIXED) {
            q = position[index[k]];
            v = velocity[index[k]];
        }
        product(above, placement, to);
        out_of(above, placement + 9, r);
        out_of(to, axis, e);
        if (kind[k] == PRISMATIC)
            for (int i = 0; i < 3; i++) r[i] = r[i] + e[i] * q;
        crossed(w, r, swing);
        for (int i = 0; i < 3; i++) {
            to[TO_P + i] = above[TO_P + i] + r[i];
            to[TO_W + i] = w[i];
            to[TO_V + i] = above[TO_V + i] + swing[i];
            if (kind[k] == REVOLUTE) to[TO_W + i] = w[i] + e[i] * v;
            if (kind[k] == PRISMATIC) to[TO_V + i] = to[TO_V + i] + e[i] * v;
        }
        if (kind[k] == REVOLUTE) {
            const double x = axis[0], y = axis[1], z = axis[2], s = sin(q), c = cos(q), t = 1.0 - c;
            const double turn[9] = {c + x * x * t,     x * y * t - z * s, x * z * t + y * s,
                                    x * y * t + z * s, c + y * y * t,     y * z * t - x * s,
                                    x * z * t - y * s, y * z * t + x * s, c + z * z * t};
            double R[9];
            memcpy(R, to, sizeof R);
            product(R, turn, to);
        }
        if (before != NULL) {
            const double *faster = above + TO_ALPHA;
            double tangential[3], centripetal[3], turned[3], along[3], a = 0.0;
            crossed(faster, r, tangential);
            crossed(w, swing, centripetal);
            if (kind[k] != FIXED) a = (v - before[index[k]]) / period;
            for (int i = 0; i < 3; i++) along[i] = e[i] * v;
            crossed(w, along, turned);
            for (int i = 0; i < 3; i++) {
                to[TO_ALPHA + i] = faster[i];
                to[TO_A + i] = (above[TO_A + i] + tangential[i]) + centripetal[i];
                if (kind[k] == REVOLUTE) to[TO_ALPHA + i] = (faster[i] + e[i] * a) + turned[i];
                if (kind[k] == PRISMATIC) to[TO_A + i] = (to[TO_A + i] + 2.0 * turned[i]) + e[i] * a;
            }
        }
    }
}

static const char *wrong_chain(const Kernel *self)
{
    Size joints = length(self, POSITION);
    if (length(self, PLACEMENT) != 12 * self->n || length(self, BASE) != 12) return "expected 12 numbers per pose";
    if (length(self, VELOCITY) != joints) return "expected a velocity per joint";
    for (Size k = 0; k < self->n; k++) {
        int64_t parent = integers(self, PARENT)[k], index = integers(self, INDEX)[k];
        if (parent < -1 || parent >= k) return "a frame before its parent";
        if (integers(self, KIND)[k] != 0 && (index < 0 || index >= joints)) return "a wrong joint";
    }
    return NULL;
}

/* imu: PlaceMotion.measure. run() */
static PyObject *run_imu(Kernel *self, PyObject *const *args)
{
    enum { BEFORE = CHAIN, GRAVITY, FRAMES, MEASURED };
    const double *gravity = doubles(self, GRAVITY);
    double *motion = doubles(self, FRAMES), *measured = doubles(self, MEASURED), felt[3];
    (void)args;
    travel(self, doubles(self, BEFORE), gravity[3], motion);
    motion += MOTION * (self->n - 1);
    for (int i = 0; i < 3; i++) felt[i] = motion[TO_A + i] - gravity[i];
    into(motion, motion + TO_W, measured);
    into(motion, felt, measured + 3);
    Py_RETURN_NONE;
}

static const char *wrong_imu(const Kernel *self)
{
    if (self->n == 0 || length(self, 8) != length(self, POSITION) || length(self, 9) != 4 || length(self, 11) != 6)
        return "vectors of another length";
    return length(self, 10) == MOTION * self->n ? wrong_chain(self) : "motion of another size";
}

/* momenta: LinkMomenta.update. run() */
static PyObject *run_momenta(Kernel *self, PyObject *const *args)
{
    enum { NODES = CHAIN, INERTIAS, FRAMES, MOMENTA };
    const int64_t *nodes = integers(self, NODES);
    double *frames = doubles(self, FRAMES);
    (void)args;
    travel(self, NULL, 0.0, frames);
    for (Size k = 0; k < length(self, NODES); k++) {
        const double *own = doubles(self, INERTIAS) + 16 * k, *pose = own + 4, *motion = frames + MOTION * nodes[k];
        double *momenta = doubles(self, MOMENTA) + 9 * k, arm[3], spin[3], part[3], swing[3];
        out_of(motion, pose + 9, arm);
        into(motion, motion + TO_W, part);
        into(pose, part, spin);
        for (int i = 0; i < 3; i++) spin[i] = own[1 + i] * spin[i];
        out_of(pose, spin, part);
        out_of(motion, part, momenta + 6);
        crossed(motion + TO_W, arm, swing);
        for (int i = 0; i < 3; i++) {
            momenta[i] = motion[TO_P + i] + arm[i];
            momenta[3 + i] = own[0] * (motion[TO_V + i] + swing[i]);
        }
    }
    Py_RETURN_NONE;
}

static const char *wrong_momenta(const Kernel *self)
{
    Size bodies = length(self, 8);
    if (length(self, 9) != 16 * bodies || length(self, 11) != 9 * bodies) return "bodies of unequal number";
    if (length(self, 10) != MOTION * self->n || !indices_within(self, 8, self->n)) return "motion of another size";
    return wrong_chain(self);
}

/* Three numbers of a tuple; false with a Python error set. */
static int vector(PyObject *of, Size at, double *found)
{
    PyObject *values = PyTuple_GetItem(of, at);
    for (Size i = 0; i < 3; i++) {
        PyObject *value = values != NULL ? PyTuple_GetItem(values, i) : NULL;
        if (value == NULL || !number(value, found + i)) return 0;
    }
    return 1;
}

/* wrenches: WrenchSensors.measure without attachments. run(points): PyBullet's contact points, which it computes. n is
 * the number of bodies on links. */
static PyObject *run_wrenches(Kernel *self, PyObject *const *args)
{
    enum { NOW, BEFORE, INERTIAS, PULLS, ROWS, NUMBERS, GRAVITY, FORCES, FRAMES, NODES, CARRIED, SENSORS };
    enum { BODY = 1, LINK = 3, PLACE = 5, NORMAL = 7, FORCE = 9 };
    const double *now = doubles(self, NOW), *before = doubles(self, BEFORE), *inertias = doubles(self, INERTIAS);
    const double *pulls = doubles(self, PULLS), *gravity = doubles(self, GRAVITY);
    const int64_t *rows = integers(self, ROWS);
    double *forces = doubles(self, FORCES);
    Size n = self->n, points = PyTuple_Size(args[0]);
    if (points < 0) return NULL;
    for (Size k = 0; k < n; k++) {
        const double *centre = now + 9 * k;
        double *force = forces + 6 * k, moment[3];
        for (int i = 0; i < 3; i++)
            force[i] = (now[9 * k + 3 + i] - before[9 * k + 3 + i]) / gravity[3] - inertias[16 * k] * gravity[i];
        crossed(centre, force, moment);
        for (int i = 0; i < 3; i++)
            force[3 + i] = ((now[9 * k + 6 + i] - before[9 * k + 6 + i]) / gravity[3] + moment[i]) - pulls[6 * k + 3 + i];
        for (int i = 0; i < 3; i++) force[i] = force[i] - pulls[6 * k + i];
    }
    for (Size at = 0; at < points; at++) {
        PyObject *point = PyTuple_GetItem(args[0], at);
        double normal[3], along[3], across[3], press, first, second, place[3], moment[3], push[3];
        int64_t row[2];
        for (int side = 0; side < 2; side++) {
            PyObject *body = PyTuple_GetItem(point, BODY + side), *link = PyTuple_GetItem(point, LINK + side);
            long long own, child;
            if (body == NULL || link == NULL) return NULL;
            own = PyLong_AsLongLong(body);
            child = PyLong_AsLongLong(link);
            if (PyErr_Occurred()) return NULL;
            row[side] = own == *integers(self, NUMBERS) && child >= 0 && child < length(self, ROWS) ? rows[child] : -1;
        }
        if (row[0] < 0 && row[1] < 0) continue;
        if (!vector(point, NORMAL, normal) || !vector(point, FORCE + 2, along) || !vector(point, FORCE + 4, across))
            return NULL;
        for (int i = 0; i < 3; i++) {
            PyObject *value = PyTuple_GetItem(point, FORCE + (i == 0 ? 0 : 2 * i - 1));
            if (value == NULL || !number(value, i == 0 ? &press : i == 1 ? &first : &second)) return NULL;
        }
        for (int side = 0; side < 2; side++) {
            double *force = forces + 6 * row[side];
            if (row[side] < 0) continue;
            if (!vector(point, PLACE + side, place)) return NULL;
            for (int i = 0; i < 3; i++) {
                push[i] = (press * normal[i] + first * along[i]) + second * across[i];
                if (side == 1) push[i] = -push[i];
            }
            crossed(place, push, moment);
            for (int i = 0; i < 3; i++) {
                force[i] = force[i] - push[i];
                force[3 + i] = force[3 + i] - moment[i];
            }
        }
    }
    for (Size s = 0; SENSORS + s < self->count; s++) {
        const unsigned char *carried = flags(self, CARRIED) + s * n;
        const double *motion = doubles(self, FRAMES) + MOTION * integers(self, NODES)[s];
        double sum[6] = {0.0}, moment[3], *values = doubles(self, SENSORS + s);
        for (Size k = 0; k < n; k++)
            for (int i = 0; carried[k] && i < 6; i++) sum[i] = sum[i] + forces[6 * k + i];
        crossed(motion + TO_P, sum, moment);
        for (int i = 0; i < 3; i++) {
            moment[i] = moment[i] - sum[3 + i];
            sum[i] = -sum[i];
        }
        into(motion, sum, values);
        into(motion, moment, values + 3);
    }
    Py_RETURN_NONE;
}

static const char *wrong_wrenches(const Kernel *self)
{
    Size n = self->n, sensors = self->count - 11;
    for (Size k = 0; k < length(self, 4); k++)
        if (integers(self, 4)[k] >= n) return "a link of no body";
    if (length(self, 2) != 16 * n || length(self, 5) != 1 || length(self, 6) != 4) return "vectors of another length";
    if (length(self, 9) != sensors || length(self, 10) != sensors * n) return "sensors of unequal number";
    if (!indices_within(self, 9, length(self, 8) / MOTION)) return "a sensor on no frame";
    for (Size k = 11; k < self->count; k++)
        if (length(self, k) != 6) return "expected 6 numbers per wrench";
    return NULL;
}

static const Law LAWS[] = {
    {"errors", "d2d1d1D2", 1, run_errors, NULL},
    {"pid", "d2d2d1d1d1d1d1d1b1d1b1d1d1D1D1d1d1D1b0", 2, run_pid, wrong_pid},
    {"sample", "d0d0d0D3D0", 2, run_sample, wrong_sample},
    {"copies", "|D0i0d0", 0, run_copies, wrong_copies},
    {"model_efforts", "d1d1i0i0d0|i0D0", 2, run_model_efforts, wrong_model_efforts},
    {"window", "d1d1d1d1d1d0d0D0B0", 0, run_window, wrong_window},
    {"actuation", "d0d0i1d1d1d1d1d1d1d2d1d0B1I1D0b0", 0, run_actuation, wrong_actuation},
    {"rows", "|D0d0", 1, run_rows, wrong_rows},
    {"scan", "d0i0i0i0d0b1d0d0D0D0", 0, run_scan, wrong_scan},
    {"raster", "d0d0i0i0i0d0d3b1d0d0d0D0D0I0D0D0", 0, run_raster, wrong_raster},
    {"sensor", "d1D1d0b0d1d1d1D0B0D1d0i0", 1, run_sensor, wrong_sensor},
    {"imu", "i1i1i1d0d3d0d0d0d0d0D0D0", 0, run_imu, wrong_imu},
    {"momenta", "i1i1i1d0d3d0d0d0i0d0D0D0", 0, run_momenta, wrong_momenta},
    {"wrenches", "d9d9d0d6i0i0d0D6d0i0b0|D0", 1, run_wrenches, wrong_wrenches},
    {NULL, NULL, 0, NULL, NULL},
};

/* ---- the type and the module ---- */

static PyObject *kernel_run(PyObject *object, PyObject *const *args, Py_ssize_t count)
{
    Kernel *self = (Kernel *)object;
    if (count != self->law->args) {
        PyErr_Format(PyExc_TypeError, "%s takes %zd arguments, not %zd", self->law->name, self->law->args, count);
        return NULL;
    }
    return self->law->run(self, args);
}

static void kernel_dealloc(PyObject *object)
{
    Kernel *self = (Kernel *)object;
    PyTypeObject *type = Py_TYPE(object);
    for (Size k = 0; k < self->count; k++) PyBuffer_Release(&self->arrays[k]);
    PyMem_Free(self->arrays);
    ((freefunc)PyType_GetSlot(type, Py_tp_free))(object);
    Py_DECREF(type);
}

static PyMethodDef kernel_methods[] = {
    {"run", (PyCFunction)(void (*)(void))kernel_run, METH_FASTCALL, "Apply the law to the arrays."},
    {NULL, NULL, 0, NULL},
};
static PyType_Slot kernel_slots[] = {
    {Py_tp_dealloc, kernel_dealloc},
    {Py_tp_methods, kernel_methods},
    {0, NULL},
};
static PyType_Spec kernel_spec = {
    "manipcli.control.compiled.Kernel", sizeof(Kernel), 0, Py_TPFLAGS_DEFAULT | Py_TPFLAGS_DISALLOW_INSTANTIATION, kernel_slots,
};

/* The two characters of array `k`; NULL if the law has no such array. */
static const char *field_of(const Law *law, Size k)
{
    const char *groups = strchr(law->fields, '|');
    Size fixed = (groups ? groups - law->fields : (Size)strlen(law->fields)) / 2;
    if (k < fixed) return law->fields + 2 * k;
    return groups ? groups + 1 + 2 * ((k - fixed) % ((Size)strlen(groups + 1) / 2)) : NULL;
}

/* Whether the number of arrays is that of the law, with whole groups. */
static int fits(const Law *law, Size count)
{
    const char *groups = strchr(law->fields, '|');
    Size fixed = (groups ? groups - law->fields : (Size)strlen(law->fields)) / 2;
    return groups ? count >= fixed && (count - fixed) % ((Size)strlen(groups + 1) / 2) == 0 : count == fixed;
}

/* Takes one array; false with a Python error set: BufferError for its layout or type, ValueError for its length. */
static int take(Kernel *self, PyObject *array, const char *field)
{
    Py_buffer *view = &self->arrays[self->count];
    char type = field[0] | 0x20;
    int write = field[0] != type ? PyBUF_WRITABLE : 0;
    if (PyObject_GetBuffer(array, view, PyBUF_C_CONTIGUOUS | PyBUF_FORMAT | write) < 0) {
        PyErr_Clear();
        PyErr_Format(PyExc_BufferError, "%s: array %zd is not contiguous, or read-only", self->law->name, self->count);
        return 0;
    }
    self->count++;
    if (!has_type(view, type)) {
        PyErr_Format(PyExc_BufferError, "%s: array %zd has the type '%s'", self->law->name, self->count - 1,
                     view->format ? view->format : "B");
        return 0;
    }
    if (field[1] != '0' && view->len != self->n * (field[1] - '0') * view->itemsize) {
        PyErr_Format(PyExc_ValueError, "%s: array %zd has another length", self->law->name, self->count - 1);
        return 0;
    }
    return 1;
}

static PyObject *bind(PyObject *module, PyObject *args)
{
    PyTypeObject *type = *(PyTypeObject **)PyModule_GetState(module);
    Size count = PyTuple_Size(args) - 2;
    const char *name, *wrong;
    const Law *law = LAWS;
    Kernel *self;
    if (count < 0) {
        PyErr_SetString(PyExc_TypeError, "bind(name, n, *arrays)");
        return NULL;
    }
    name = PyUnicode_AsUTF8AndSize(PyTuple_GetItem(args, 0), NULL);
    if (name == NULL) return NULL;
    while (law->name != NULL && strcmp(law->name, name) != 0) law++;
    if (law->name == NULL || !fits(law, count)) {
        PyErr_Format(PyExc_ValueError, "no law '%s' of %zd arrays", name, count);
        return NULL;
    }
    self = (Kernel *)PyType_GenericAlloc(type, 0);
    if (self == NULL) return NULL;
    self->law = law;
    self->n = PyLong_AsSsize_t(PyTuple_GetItem(args, 1));
    self->arrays = (Py_buffer *)PyMem_Calloc(count ? count : 1, sizeof(Py_buffer));
    if (self->arrays == NULL) PyErr_NoMemory();
    if (PyErr_Occurred()) goto failed;
    for (Size k = 0; k < count; k++)
        if (!take(self, PyTuple_GetItem(args, k + 2), field_of(law, k))) goto failed;
    wrong = law->wrong != NULL ? law->wrong(self) : NULL;
    if (wrong != NULL) {
        PyErr_Format(PyExc_ValueError, "%s: %s", law->name, wrong);
        goto failed;
    }
    return (PyObject *)self;
failed:
    Py_DECREF(self);
    return NULL;
}

static PyMethodDef module_methods[] = {
    {"bind", bind, METH_VARARGS, "bind(name, n, *arrays): a law on these arrays."},
    {NULL, NULL, 0, NULL},
};

static int module_exec(PyObject *module)
{
    PyTypeObject **state = (PyTypeObject **)PyModule_GetState(module);
    *state = (PyTypeObject *)PyType_FromModuleAndSpec(module, &kernel_spec, NULL);
    if (*state == NULL) return -1;
    return PyModule_AddIntConstant(module, "SOURCE_CRC", (long)(SOURCE_CRC & 0x7fffffff));
}

static void module_free(void *module)
{
    PyTypeObject **state = (PyTypeObject **)PyModule_GetState((PyObject *)module);
    if (state != NULL) Py_CLEAR(*state);
}

static PyModuleDef_Slot module_slots[] = {
    {Py_mod_exec, module_exec},
    {0, NULL},
};
static struct PyModuleDef module_definition = {
    PyModuleDef_HEAD_INIT, "_kernels", NULL, sizeof(PyTypeObject *), module_methods, module_slots, NULL, NULL, module_free,
};

PyMODINIT_FUNC PyInit__kernels(void) { return PyModuleDef_Init(&module_definition); }
