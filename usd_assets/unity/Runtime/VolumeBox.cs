// SPDX-License-Identifier: Apache-2.0
using UnityEngine;

namespace StereoCell
{
    /// <summary>A box that is marched: which channels of the specimen its texture holds, up to four.</summary>
    [DisallowMultipleComponent, RequireComponent(typeof(MeshRenderer)), AddComponentMenu("")]
    public sealed class VolumeBox : MonoBehaviour
    {
        static readonly int Size = Shader.PropertyToID("_Size");
        static readonly int[] ToBox =
        {
            Shader.PropertyToID("_ToBox0"), Shader.PropertyToID("_ToBox1"), Shader.PropertyToID("_ToBox2"),
        };

        [Tooltip("Places in the specimen's channels, in the order of the texture's components")]
        public int[] channels = new int[0];

        /// <summary>
        /// The sum over the box's axes of the distance from the eye, um. In a grid of boxes a ray leaves a box only
        /// for one that has more of it, so far boxes first is the right order, also where boxes differ in size.
        /// (By the distance of their centres, as Unity sorts, it is not.)
        /// </summary>
        public float DistanceFrom(Vector3 eye)
        {
            var material = GetComponent<Renderer>().sharedMaterial;
            var local = transform.InverseTransformPoint(eye);
            var at = new Vector4(local.x, local.y, local.z, 1);
            var size = material.GetVector(Size);
            float sum = 0;
            for (var axis = 0; axis < 3; axis++)
            {
                var place = Vector4.Dot(material.GetVector(ToBox[axis]), at);
                sum += Mathf.Max(0, Mathf.Max(-place, place - size[axis]));
            }
            return sum;
        }
    }
}
