// SPDX-License-Identifier: Apache-2.0
using UnityEngine;

namespace StereoCell
{
    /// <summary>A box that is marched: which channels of the specimen its texture holds, up to four.</summary>
    [DisallowMultipleComponent, RequireComponent(typeof(MeshRenderer)), AddComponentMenu("")]
    public sealed class VolumeBox : MonoBehaviour
    {
        [Tooltip("Places in the specimen's channels, in the order of the texture's components")]
        public int[] channels = new int[0];
    }
}
