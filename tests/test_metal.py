# SPDX-License-Identifier: GPL-3.0-or-later
"""The GLSL sources satisfy Blender's Metal backend, which makes a C++ class of each program.

Its types and functions are those of the Metal Shading Language, its functions are members of the class [Metal24].
"""

import re
from pathlib import Path

from hair_addon.core.kernels import glsl_text
from hair_addon.core.shading.light_paths import gather, seen_rays, start_places

SHADERS = Path(__file__).resolve().parents[1] / "shaders"
SOURCES = sorted([*SHADERS.rglob("*.*"), *(SHADERS.parent / "hair_addon" / "core").rglob("*.strand")])
GLSL = [path for path in SOURCES if path.suffix != ".md"]
KERNELS = gather._gather, gather._even, start_places._measure, start_places._see, seen_rays._find, seen_rays._place
TRANSLATED = {kernel.key: glsl_text.kernel_text(kernel).source for kernel in KERNELS}

# Keywords of C++ and of the language that GLSL lets be names, and what Blender's backend defines as macros.
_CPP = """
alignas alignof and and_eq asm auto bitand bitor catch char class compl constexpr decltype delete enum explicit
export extern friend goto inline long mutable namespace new noexcept not not_eq nullptr operator or or_eq
private protected public register reinterpret_cast short signed sizeof static static_assert template this
thread_local throw try typedef typeid typename union unsigned using virtual volatile wchar_t xor xor_eq
"""
_METAL = """
array atomic atomic_int atomic_uint bfloat constant depth2d device fragment half imageblock kernel metal object
mesh packed_float3 patch_control_point ray_data sampler size_t texture texture1d texture2d texture3d thread
threadgroup threadgroup_imageblock uchar ushort ulong vertex visible
"""
_MACROS = "st select THD mod equal notEqual lessThan discard SStruct"
# Functions of the standard library that a member of the same name would hide, whatever its arguments are.
_FUNCTIONS = """
abs acos all any as_type asin atan atan2 ceil clamp copysign cos cross degrees determinant distance dot exp exp2
faceforward fabs floor fma fmax fmin fract isfinite isinf isnan ldexp length log log2 max min mix normalize pow
powr radians reflect refract rint rotate round rsqrt sign sin sinh smoothstep sqrt step tan tanh transpose trunc
"""
RESERVED = set(f"{_CPP} {_METAL} {_MACROS}".split())

_TYPE = r"(?:void|bool|int|uint|float|[biu]?vec[234]|mat[234]|sampler\w+|lanes|ints|uints|flags|vector|[A-Z]\w*)"
_DECLARED = re.compile(rf"\b{_TYPE}\s+(\w+)\s*(?=[;,=()\[{{])")
_FUNCTION = re.compile(rf"^{_TYPE}\s+(\w+)\s*\([^;{{]*\)\s*([;{{])", re.MULTILINE)
_STRUCT = re.compile(r"\bstruct\s+(\w+)")


def code(path):
    """Return the text of a source without its comments."""
    return re.sub(r"//[^\n]*", "", path.read_text(encoding="utf-8"))


CODE = {path.name: code(path) for path in GLSL} | TRANSLATED
STRUCTS = {name for text in CODE.values() for name in _STRUCT.findall(text)}


def where(found):
    """Return {file, or Warp's kernel: what was found in its code} where that is not empty."""
    every = {name: found(text) for name, text in CODE.items()}
    return {name: bad for name, bad in every.items() if bad}


def test_no_name_is_a_word_of_metal():
    assert not where(lambda text: set(_DECLARED.findall(text)) & RESERVED)


def test_no_function_is_declared_before_its_definition():
    """No function is declared before its definition, as members of a class cannot be."""
    assert not where(lambda text: [name for name, end in _FUNCTION.findall(text) if end == ";"])


def test_no_function_hides_one_of_metal():
    assert not where(lambda text: {name for name, _end in _FUNCTION.findall(text)} & set(_FUNCTIONS.split()))


def test_structs_and_arrays_are_filled_by_their_members():
    """Structs and arrays are filled by their members, as C++ has no constructors of these."""
    structs = "|".join(sorted(STRUCTS))
    assert not where(lambda text: re.findall(rf"\b(?:{structs})\s*\(|{_TYPE}\s*\[\w*\]\s*\(", text))


def test_the_laws_see_declarations():
    assert len(GLSL) > 80 and {"Segment", "FibreLobes", "Surface"} <= STRUCTS
    names = {name for text in CODE.values() for name in _DECLARED.findall(text)}
    assert {"strand_texel", "half_width", "along", "row", "trace_cell", "half_"} <= names
